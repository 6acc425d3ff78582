"""`codesign-bench pack`: write finished results into one archive that describes and checks itself."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import out_file, path
from codesign_bench.console import printer
from codesign_bench.storage.places import results_folder

HELP = "write finished cells and tables of a results folder into one checked archive"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the results, the archive, and what it says of itself."""
    parser.add_argument("results", type=path, metavar="RUNS", help="results folder")
    parser.add_argument("--out", type=out_file, required=True, metavar="FILE", help="the archive, .zip; never replaced")
    parser.add_argument("--title", default="", metavar="TEXT", help="its name on the leaderboard; default: RUNS's name")
    parser.add_argument("--by", default="", metavar="TEXT", help="who submits it")
    parser.add_argument("--note", default="", metavar="TEXT", help="what a reader should know, e.g. a link to a paper")
    parser.add_argument(
        "--tuning",
        nargs="+",
        default=[],
        metavar="DIR|TEXT",
        help="how the settings were found: folders of `tune`, whose steps are counted, a number of steps, or words",
    )
    parser.add_argument(
        "--brief",
        action="store_true",
        help="only what the leaderboard needs: default variants without policies and metrics, and reference points",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Write the archive; print what stays out, what is in it, and its path."""
    from codesign_bench.sharing.pack import Order, pack

    log = printer(console)
    order = Order(options.title, options.by, options.note, options.tuning, brief=options.brief)
    manifest = pack(results_folder(options.results, must_exist=True), options.out, order, log)
    size = options.out.stat().st_size / 1e6
    log(
        f"{manifest.cells} cells, {manifest.policies} policies, {len(manifest.files)} files, {size:.1f} MB, all checked"
    )
    log(str(options.out))
    return 0
