"""`codesign-bench bench`: measure speed on this machine."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from codesign_bench.cli.arguments import ALL, check_at_least_one, chosen_tasks, integer
from codesign_bench.errors import unknown_name

HELP = "measure speed on this machine"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is measured, and how."""
    kinds = parser.add_subparsers(required=True, metavar="tasks|learner", dest="what")
    tasks = kinds.add_parser("tasks", help="environment steps beside the raw engine", allow_abbrev=False)
    tasks.add_argument("--task", nargs="+", default=[ALL], metavar="T", help="names, or all (default)")
    tasks.add_argument("--seconds", type=float, default=5.0, metavar="S", help="for each task; default: 5")
    learner = kinds.add_parser("learner", help="our learners beside others'", allow_abbrev=False)
    learner.add_argument("--task", default="push", metavar="T", help="default: push")
    learner.add_argument("--cores", type=integer, default=1, metavar="N", help="default: 1")
    learner.add_argument("--cells", type=integer, default=1, metavar="N", help="cells at once; default: 1")
    learner.add_argument("--batch-size", type=integer, default=50_000, metavar="N", help="default: 50000")
    learner.add_argument("--minibatch-size", type=integer, default=2_000, metavar="N", help="default: 2000")
    learner.add_argument("--epochs", type=integer, default=10, metavar="N", help="default: 10")
    learner.add_argument("--repeats", type=integer, default=3, metavar="N", help="default: 3")
    learner.add_argument("--only", nargs="+", metavar="NAME", help="some of the learners; default: all")
    learner.add_argument("--out", type=Path, metavar="FILE", help="write the numbers there as JSON")


def run(options: argparse.Namespace, console: Console) -> int:
    """Measure and print a table."""
    if options.what == "tasks":
        from codesign_bench.benchmarks.tasks import bench_tasks

        bench_tasks(chosen_tasks(options.task), options.seconds, console)
        return 0
    from codesign_bench.benchmarks.learner import bench_learner, contestants
    from codesign_bench.benchmarks.workload import Workload

    check_at_least_one(options, "cores", "cells", "batch_size", "minibatch_size", "epochs", "repeats")
    wanted = options.only or list(contestants())
    for name in wanted:
        if name not in contestants():
            raise unknown_name("learner", name, contestants())
    work = Workload(
        task=options.task,
        batch_size=options.batch_size,
        minibatch_size=options.minibatch_size,
        epochs=options.epochs,
        cores=options.cores,
        cells=options.cells,
        repeats=options.repeats,
    )
    bench_learner(work, wanted, options.out, console)
    return 0
