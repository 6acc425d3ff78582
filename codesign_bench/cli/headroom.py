"""`codesign-bench headroom`: what a policy's controller would earn with other tools, and the best that is known."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Annotated, Any

from rich.console import Console

from codesign_bench.cli.arguments import (
    Jobs,
    OfKind,
    add_dry_run,
    add_json,
    add_results,
    chosen_tasks,
    own_results,
    path,
    tell_work,
)
from codesign_bench.config.values import Within
from codesign_bench.console import JsonLines, print_table, printer, tell_left_out
from codesign_bench.errors import UserError

HELP = "find better tools for a policy's own controller, and better episodes of every evaluation instance"
Instances = Annotated[int, Within(1, 1_000_000)]
Candidates = Annotated[int, Within(0, 1_000_000)]
Popsize = Annotated[int, Within(2, 10_000)]
Sigma = Annotated[float, Within(1e-12, 10.0)]
RandomTools = Annotated[int, Within(1, 10_000)]
OF_SEARCHES = ("candidates", "popsize", "sigma0")
"""Options of both searches, for tools and for whole episodes."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the policies, the results folder, the instances and the budgets of the searches."""
    parser.add_argument(
        "--policy", nargs="+", type=path, default=[], metavar="CELL", help="folders of finished cells to be measured"
    )
    parser.add_argument(
        "--update",
        action="store_true",
        help="renew the best known episodes: by the policies at hand, by headroom, by a search of designs and controls",
    )
    parser.add_argument(
        "--task", nargs="+", metavar="T", help="with --update: names, or all; default: the tasks of the cells at hand"
    )
    add_results(parser, own_results)
    add_json(parser)
    add_dry_run(parser, "say how many episodes would be played for each policy and task, and how long that takes")
    parser.add_argument(
        "--instances",
        type=OfKind(Instances),
        metavar="N",
        help="only N evaluation instances: the first, or with --update those searched least; default: all",
    )
    parser.add_argument(
        "--candidates",
        type=OfKind(Candidates),
        metavar="N",
        help="candidates of CMA-ES for every instance, 0: none; default: 240",
    )
    parser.add_argument("--popsize", type=OfKind(Popsize), metavar="N", help="candidates of a generation; default: 12")
    parser.add_argument(
        "--sigma0",
        type=OfKind(Sigma),
        metavar="S",
        help="initial standard deviation, all numbers are in [-1, 1]; default: 0.3 for tools, 0.1 for whole episodes",
    )
    parser.add_argument(
        "--random-tools", type=OfKind(RandomTools), metavar="N", help="random tools for every instance; default: 8"
    )
    parser.add_argument(
        "--jobs",
        type=OfKind(Jobs),
        default=1,
        metavar="N",
        help="processes that try tools side by side; default: 1; --update uses one",
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Measure the policies' instances that are missing and print the means; renew the best known episodes."""
    if not options.policy and not options.update:
        raise UserError("headroom: give --policy CELL, --update, or both")
    if options.task and not options.update:
        raise UserError("headroom: --task needs --update; a cell knows its task")
    if options.random_tools is not None and not options.policy:
        raise UserError("headroom: --random-tools needs --policy CELL")
    if options.policy:
        _measure(options, console)
    if options.update:
        _update(options, console)
    if options.dry_run:
        printer(console)("nothing was played")
    return 0


def _given(options: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Return the options among `names` that the user gave."""
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


def _measure(options: argparse.Namespace, console: Console) -> None:
    from codesign_bench.evaluation.headroom import Budget, expected_work, measure_cell, summary
    from codesign_bench.text_tables import markdown

    log, budget = printer(console), Budget(**_given(options, *OF_SEARCHES, "random_tools"))
    if options.dry_run:
        limits = {"instances": options.instances, "jobs": options.jobs}
        for folder in options.policy:
            tell_work(console, str(folder), expected_work(folder, options.results, budget, **limits))
        return
    paths = [
        measure_cell(folder, options.results, budget, log, instances=options.instances, jobs=options.jobs)
        for folder in options.policy
    ]
    header, rows = summary(paths)
    if isinstance(console, JsonLines):
        print_table(console, header, rows)
    else:
        log(markdown(header, rows).rstrip())


def _update(options: argparse.Namespace, console: Console) -> None:
    from codesign_bench.evaluation.best_known import Search, expected_work, update
    from codesign_bench.evaluation.reference_points import renew_best_known
    from codesign_bench.storage.cells import find_cells, open_cell
    from codesign_bench.storage.survey import lines, survey
    from codesign_bench.task import load_task

    results: Path = options.results
    log = printer(console)
    tell_left_out(lines(results, survey(results)))
    cells = [*(open_cell(folder) for folder in options.policy), *(find_cells(results) if results.is_dir() else ())]
    cells = list({cell.folder.resolve(): cell for cell in cells}.values())
    present = list(dict.fromkeys(cell.record.task for cell in cells))
    if not options.task and not present:
        raise UserError(f"no cells in '{results}' yet; name a task with --task, or cells with --policy")
    search = Search(**_given(options, *OF_SEARCHES))
    for name in chosen_tasks(options.task or present, log):
        task = load_task(name)
        tell_work(console, name, expected_work(task, cells, search, instances=options.instances))
        if options.dry_run:
            continue
        done = update(results, task, cells, search, log, instances=options.instances)
        log(f"{name}: {len(done.improved)} instances improved in {done.env_steps:,} environment steps")
        if not renew_best_known(results, task):
            log(f"{name} has no reference points yet; measure them with: codesign-bench reference --task {name}")
