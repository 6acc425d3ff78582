"""`codesign-bench compare`: the differences between two results, with intervals and adjusted p-values."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import ALL, path
from codesign_bench.console import print_table, printer, tell_left_out
from codesign_bench.storage.places import KINDS, results_folder

HELP = "print how two results differ per task, with intervals and adjusted p-values"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the two results and what of them is compared."""
    for name in ("a", "b"):
        parser.add_argument(name, type=path, metavar=name.upper(), help=KINDS.replace("%", "%%"))
    parser.add_argument(
        "--method",
        nargs="+",
        metavar="M",
        help="compare this method alone; with two names, the first of A with the second of B; default: all in both",
    )
    parser.add_argument("--variants", action="store_true", help="also compare variants other than `default`")


def run(options: argparse.Namespace, console: Console) -> int:
    """Print the table, what is not compared, and how the cells were made otherwise."""
    from codesign_bench.sharing.compare import HEADER, compare, notes, rows_of
    from codesign_bench.storage.survey import lines, survey

    first, second = (results_folder(given, must_exist=True) for given in (options.a, options.b))
    for folder in dict.fromkeys((first, second)):
        tell_left_out(lines(folder, survey(folder)))
    found = compare(
        first, second, methods=None if options.method == [ALL] else options.method, variants=options.variants
    )
    print_table(console, HEADER, rows_of(found))
    log = printer(console)
    for line in notes(found):
        log(line)
    return 0
