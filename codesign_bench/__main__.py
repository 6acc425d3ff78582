"""Make `python -m codesign_bench` the same as `codesign-bench`."""

import sys

from codesign_bench.cli import main

if __name__ == "__main__":
    sys.exit(main())
