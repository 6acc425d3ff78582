"""`codesign-bench reference`: measure what idling, random tools, scripts and single tools reach on a task."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import (
    ALL,
    Jobs,
    OfKind,
    add_dry_run,
    add_json,
    add_results,
    chosen_tasks,
    own_results,
    tell_work,
)
from codesign_bench.console import JsonLines, printer, tell_left_out
from codesign_bench.machine import available_cores

HELP = "measure reference points: idling, random tools, the script, the best single tool, the best known"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the tasks, the results folder and what is measured again."""
    parser.add_argument(
        "--task",
        nargs="+",
        default=[ALL],
        metavar="T",
        help="names, all (default; the paper's six), or beyond (all others)",
    )
    add_results(parser, own_results)
    add_json(parser)
    add_dry_run(parser, "say how many episodes would be played on each task, and how long that takes")
    parser.add_argument(
        "--again", action="store_true", help="also measure what is there, e.g. after a change to a task's scene"
    )
    parser.add_argument(
        "--jobs", type=OfKind(Jobs), metavar="N", help="processes that play side by side; default: one per core"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Measure what is missing, renew the best known, and print the points."""
    from codesign_bench.evaluation.reference_points import expected_work, measure_missing
    from codesign_bench.storage.reference_points import load_reference_points
    from codesign_bench.storage.survey import lines, survey
    from codesign_bench.task import load_task
    from codesign_bench.text_tables import markdown

    log = printer(console)
    tasks = chosen_tasks(options.task, log)
    tell_left_out(lines(options.results, survey(options.results)))
    jobs = options.jobs or available_cores()
    if options.dry_run:
        for name in tasks:
            tell_work(console, name, expected_work(options.results, load_task(name), again=options.again, jobs=jobs))
        log("nothing was played")
        return 0
    measure_missing(options.results, tasks, log, again=options.again, jobs=jobs)
    points = load_reference_points(options.results)
    own = points[points["task"].isin(tasks)].to_dict("records")
    if isinstance(console, JsonLines):
        for row in own:
            console.event("point", {str(name): value for name, value in row.items()})
        return 0
    rows = [
        [row["task"], row["point"], f"{row['return_mean']:.2f}", f"{row['success_rate']:.2f}", row["source"]]
        for row in own
    ]
    log(markdown(["task", "point", "return", "success", "source"], rows).rstrip())
    return 0
