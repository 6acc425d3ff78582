"""`codesign-bench reference`: measure what idling, random tools, scripts and single tools reach on a task."""

from __future__ import annotations

import argparse
import os

from rich.console import Console

from codesign_bench.cli.arguments import ALL, Jobs, OfKind, add_json, add_results, chosen_tasks, out_folder
from codesign_bench.console import printer, tell_left_out

HELP = "measure reference points: idling, random tools, the script, the best single tool, the best known"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the tasks, the results folder and what is measured again."""
    parser.add_argument("--task", nargs="+", default=[ALL], metavar="T", help="names, or all (default)")
    add_results(parser, out_folder)
    add_json(parser)
    parser.add_argument(
        "--again", action="store_true", help="also measure what is there, e.g. after a change to a task's scene"
    )
    parser.add_argument(
        "--jobs", type=OfKind(Jobs), metavar="N", help="processes that play side by side; default: one per core"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Measure what is missing, renew the best known, and print the points."""
    from codesign_bench.evaluation.reference_points import measure_missing
    from codesign_bench.storage.reference_points import load_reference_points
    from codesign_bench.storage.survey import lines, survey
    from codesign_bench.text_tables import markdown

    log = printer(console)
    tasks = chosen_tasks(options.task, log)
    tell_left_out(lines(options.results, survey(options.results)))
    jobs = options.jobs or os.cpu_count() or 1
    measure_missing(options.results, tasks, log, again=options.again, jobs=jobs)
    points = load_reference_points(options.results)
    rows = [
        [row["task"], row["point"], f"{row['return_mean']:.2f}", f"{row['success_rate']:.2f}", row["source"]]
        for row in points[points["task"].isin(tasks)].to_dict("records")
    ]
    log(markdown(["task", "point", "return", "success", "source"], rows).rstrip())
    return 0
