"""The command line: one file per command, its arguments beside what it does."""

from codesign_bench.cli.program import main

__all__ = ["main"]
