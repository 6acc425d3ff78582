"""`codesign-bench deploy`: run a policy and its tools on a simulated robot arm."""

from __future__ import annotations

import argparse
from typing import Annotated

from rich.console import Console

from codesign_bench.cell.grid import Seed
from codesign_bench.cli.arguments import DEFAULT_RESULTS, OfKind, add_out, path
from codesign_bench.config.values import Within
from codesign_bench.console import printer
from codesign_bench.errors import UserError

HELP = "run a policy and its tools on a simulated robot arm"
Tool = Annotated[int, Within(0, 10_000)]
Trials = Annotated[int, Within(1, 10_000)]
BelowOne = Annotated[float, Within(0.0, 1.0, open_high=True)]
Latency = Annotated[int, Within(0, 10_000)]
CONDITIONS = ("arm", "observation_noise", "latency", "friction", "mass")
"""Options that set a condition of the trials."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the policy, the trials and their conditions."""
    parser.add_argument(
        "--policy",
        type=path,
        required=True,
        metavar="CELL",
        help="finished cell, also RESULTS.zip/... or reference/...",
    )
    parser.add_argument("--task", metavar="T", help="default: the task of --policy")
    parser.add_argument(
        "--protocol", action="store_true", help="the paper's Table 1: five trials of each tool and the grid of starts"
    )
    parser.add_argument(
        "--tool", nargs="+", type=OfKind(Tool), default=[], metavar="N", help="tools; default: all of them"
    )
    parser.add_argument("--trials", type=OfKind(Trials), metavar="N", help="trials of each tool; default: 1")
    parser.add_argument("--arm", help="panda (default), or ideal: the gantry used in training")
    parser.add_argument(
        "--observation-noise",
        type=OfKind(BelowOne),
        metavar="M",
        help="standard deviation of the noise on every observed length, m (default 0; the protocol uses 0.002)",
    )
    parser.add_argument(
        "--latency",
        type=OfKind(Latency),
        metavar="STEPS",
        help="delay of the observed state (default 0; the protocol uses 1)",
    )
    for name in ("friction", "mass"):
        parser.add_argument(
            f"--{name}",
            type=OfKind(BelowOne),
            metavar="SHARE",
            help=f"randomise {name} by up to +-SHARE (default 0; the protocol uses 0.2)",
        )
    parser.add_argument("--seed", type=OfKind(Seed), default=0, help="seed of noise and randomisation; default: 0")
    parser.add_argument("--no-gifs", action="store_true", help="do not write animations of the trials")
    add_out(parser, DEFAULT_RESULTS)


def run(options: argparse.Namespace, console: Console) -> int:
    """Run the trials and write the tables and pictures."""
    from dataclasses import replace

    from codesign_bench.deployment.conditions import TRIAL, Conditions
    from codesign_bench.deployment.deploy import Order, deploy
    from codesign_bench.storage.cells import open_cell
    from codesign_bench.storage.policies import policy_and_task

    if options.protocol and (options.tool or options.trials is not None):
        raise UserError("deploy: --protocol sets tools and trials itself; leave out --tool and --trials")
    given = {name: getattr(options, name) for name in CONDITIONS if getattr(options, name) is not None}
    conditions = replace(TRIAL if options.protocol else Conditions(), **given)
    conditions.check()
    policy, task = policy_and_task(options.policy, options.task)
    cell = open_cell(options.policy)
    order = Order(
        conditions,
        tools=tuple(options.tool),
        trials=1 if options.trials is None else options.trials,
        protocol=options.protocol,
        seed=options.seed,
        gifs=not options.no_gifs,
        policy_seed=cell.record.seed,
    )
    deploy(task, policy, order, options.out, printer(console), cell.name)
    return 0
