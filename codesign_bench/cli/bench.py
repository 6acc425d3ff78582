"""`codesign-bench bench`: measure the speed of tasks and learners on this machine."""

from __future__ import annotations

import argparse
from typing import Annotated, get_args

from rich.console import Console

from codesign_bench.cli.arguments import ALL, Jobs, OfKind, check_device, chosen_methods, chosen_tasks, out_file
from codesign_bench.config.profiles import DEFAULT_PROFILE, profile_named
from codesign_bench.config.run_settings import Device
from codesign_bench.config.values import Within
from codesign_bench.console import printer
from codesign_bench.errors import unknown_name

Seconds = Annotated[float, Within(0.0, 86_400.0, open_low=True)]
BatchSteps = Annotated[int, Within(1, 10_000_000)]
Passes = Annotated[int, Within(1, 10_000)]
HELP = "measure the speed of tasks and learners on this machine"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is measured and how."""
    kinds = parser.add_subparsers(required=True, metavar="tasks|learner|sweep", dest="what")
    tasks = kinds.add_parser(
        "tasks", help="environment steps, compared with the bare physics engine", allow_abbrev=False
    )
    tasks.add_argument(
        "--task",
        nargs="+",
        default=[ALL],
        metavar="T",
        help="names, all (default; the paper's six), or beyond (all others)",
    )
    tasks.add_argument("--seconds", type=OfKind(Seconds), default=5.0, metavar="S", help="seconds per task; default: 5")
    tasks.add_argument(
        "--cores",
        type=OfKind(Jobs),
        default=1,
        metavar="N",
        help="also measure batches of episodes on one core and on N; default: 1",
    )
    tasks.add_argument("--out", type=out_file, metavar="FILE", help="also write the numbers to this JSON file")
    learner = kinds.add_parser("learner", help="learners, compared with those of other libraries", allow_abbrev=False)
    learner.add_argument("--task", metavar="T", help="default: the first task that `list` shows")
    learner.add_argument("--profile", metavar="P", help="profile of the networks; default: the paper's")
    learner.add_argument("--cores", type=OfKind(Jobs), default=1, metavar="N", help="cores per cell; default: 1")
    learner.add_argument(
        "--cells", type=OfKind(Jobs), default=1, metavar="N", help="cells that run at a time; default: 1"
    )
    learner.add_argument(
        "--batch-size", type=OfKind(BatchSteps), default=50_000, metavar="N", help="steps per batch; default: 50000"
    )
    learner.add_argument(
        "--minibatch-size",
        type=OfKind(BatchSteps),
        default=2_000,
        metavar="N",
        help="steps per minibatch; default: 2000",
    )
    learner.add_argument("--epochs", type=OfKind(Passes), default=10, metavar="N", help="epochs per batch; default: 10")
    learner.add_argument("--repeats", type=OfKind(Passes), default=3, metavar="N", help="timed batches; default: 3")
    learner.add_argument("--only", nargs="+", metavar="NAME", help="names of learners; default: all")
    learner.add_argument("--out", type=out_file, metavar="FILE", help="also write the numbers to this JSON file")
    _add_sweep(kinds.add_parser("sweep", help="cells per hour of tasks, methods and profiles", allow_abbrev=False))


def _add_sweep(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--task", required=True, nargs="+", metavar="T", help="names, all, or beyond")
    parser.add_argument("--method", required=True, nargs="+", metavar="M", help="names, all, or beyond")
    parser.add_argument("--profile", nargs="+", metavar="P", help="names; default: laptop and the paper's")
    parser.add_argument("--device", choices=get_args(Device), help="device for network updates; default: cpu")
    parser.add_argument("--jobs", type=OfKind(Jobs), metavar="N", help="cells side by side; default: one per core")
    parser.add_argument("--out", type=out_file, metavar="FILE", help="also write the numbers to this JSON file")


def run(options: argparse.Namespace, console: Console) -> int:
    """Measure and print a table."""
    if options.what == "tasks":
        from codesign_bench.benchmarks.tasks import bench_tasks

        names = chosen_tasks(options.task, printer(console))
        bench_tasks(names, options.seconds, console, options.cores, options.out)
        return 0
    if options.what == "sweep":
        return _run_sweep(options, console)
    from codesign_bench.benchmarks.learner import bench_learner, contestants
    from codesign_bench.benchmarks.workload import Workload

    wanted = options.only or list(contestants())
    for name in wanted:
        if name not in contestants():
            raise unknown_name("learner", name, contestants())
    if options.profile is not None:
        profile_named(options.profile)
    named = {"task": options.task, "profile": options.profile}
    work = Workload(
        **{name: value for name, value in named.items() if value is not None},
        batch_size=options.batch_size,
        minibatch_size=options.minibatch_size,
        epochs=options.epochs,
        cores=options.cores,
        cells=options.cells,
        repeats=options.repeats,
    )
    bench_learner(work, wanted, options.out, console)
    return 0


def _run_sweep(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.benchmarks.sweep import bench_sweep
    from codesign_bench.benchmarks.workload import study_profile

    log = printer(console)
    profiles = options.profile or [DEFAULT_PROFILE, study_profile()]
    for name in profiles:
        profile_named(name)
    overrides = [] if options.device is None else [f"device={options.device}"]
    check_device(options.device)
    bench_sweep(
        chosen_tasks(options.task, log),
        chosen_methods(options.method, log),
        profiles,
        overrides,
        options.jobs,
        options.out,
        console,
    )
    return 0
