"""`codesign-bench explore`: write one HTML page in which goals are dragged and designers answer."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Annotated

from rich.console import Console

from codesign_bench.cell.grid import parse_seeds
from codesign_bench.cli.arguments import OfKind, add_out, add_results
from codesign_bench.config.values import Within
from codesign_bench.console import printer, tell_left_out

HELP = "write one HTML page in which you drag goals and see the tools that methods design"
DEFAULT_EXPLORER = Path("results/explorer.html")
Goals = Annotated[int, Within(4, 1_000)]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the results folder, the cells and the output file."""
    add_results(parser)
    parser.add_argument("--task", nargs="+", metavar="T", help="tasks of the page; default: all in the folder")
    parser.add_argument("--method", nargs="+", metavar="M", help="methods of the page; default: all in the folder")
    parser.add_argument("--seeds", metavar="N|a,b", help="seeds of the page, as in `run`; default: all in the folder")
    parser.add_argument(
        "--goals", type=OfKind(Goals), default=64, metavar="N", help="recorded goals per cell, about; default: 64"
    )
    add_out(parser, DEFAULT_EXPLORER, metavar="FILE")


def run(options: argparse.Namespace, console: Console) -> int:
    """Write the page and print its path."""
    from codesign_bench.cli.arguments import chosen_methods, chosen_tasks
    from codesign_bench.explorer.gather import Choice
    from codesign_bench.explorer.page import write_explorer
    from codesign_bench.storage.places import results_folder
    from codesign_bench.storage.survey import lines, survey

    say, results = printer(console), results_folder(options.results)
    tell_left_out(lines(results, survey(results)))
    choice = Choice(
        tasks=tuple(chosen_tasks(options.task, say)) if options.task else (),
        methods=tuple(chosen_methods(options.method, say)) if options.method else (),
        seeds=tuple(parse_seeds(options.seeds)) if options.seeds else (),
        goals=options.goals,
    )
    write_explorer(results, options.out, say, choice)
    return 0
