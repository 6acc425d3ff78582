"""`codesign-bench report`: write one HTML page that summarises a results folder."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import DEFAULT_REPORT, add_out, add_results, add_study
from codesign_bench.console import printer, tell_left_out
from codesign_bench.study import load_study

HELP = "write one HTML page that summarises a results folder"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the results folder and the output file."""
    add_study(parser)
    add_results(parser)
    add_out(parser, DEFAULT_REPORT, metavar="FILE")


def run(options: argparse.Namespace, console: Console) -> int:
    """Write the page and print its path."""
    from codesign_bench.report.page import write_report
    from codesign_bench.storage.places import results_folder
    from codesign_bench.storage.survey import lines, survey

    results = results_folder(options.results)
    tell_left_out(lines(results, survey(results)))
    write_report(results, options.out, printer(console), load_study(options.study))
    return 0
