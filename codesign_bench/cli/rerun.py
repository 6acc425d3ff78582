"""`codesign-bench rerun`: run a stored cell again from its `cell.json`, and compare the curves."""

from __future__ import annotations

import argparse
import signal
from pathlib import Path

from rich.console import Console

from codesign_bench.cli.arguments import add_dry_run, add_jobs, add_json, add_out, path

HELP = "run a stored cell again from its cell.json, and say whether the curve is the same"
DEFAULT_RERUNS = Path("results/reruns")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the cell and the folder in which it runs again."""
    parser.add_argument("cell", type=path, metavar="CELL", help="folder of a cell, or its cell.json")
    add_out(parser, DEFAULT_RERUNS)
    add_jobs(parser)
    add_json(parser)
    add_dry_run(parser, "say what would run, with the expected time and memory")


def run(options: argparse.Namespace, console: Console) -> int:
    """Run the cell again; return 1 if it failed."""
    from codesign_bench.sweep.rerun import rerun

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops a sweep as Ctrl-C does
    return rerun(options.cell, options.out, console=console, jobs=options.jobs, only_plan=options.dry_run)
