# PYTHON_ARGCOMPLETE_OK
"""The command line: one file per command, with its arguments and its action."""

from codesign_bench.cli.program import main

__all__ = ["main"]
