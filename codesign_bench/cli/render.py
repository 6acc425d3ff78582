"""`codesign-bench render`: draw episodes of a policy, a script or random behaviour as an animation or a picture."""

from __future__ import annotations

import argparse
from typing import Annotated

from rich.console import Console

from codesign_bench.cell.grid import Seed
from codesign_bench.cli.arguments import OfKind, out_file, path
from codesign_bench.config.values import Within
from codesign_bench.console import printer
from codesign_bench.errors import UserError

Episodes = Annotated[int, Within(1, 10_000)]
HELP = "draw episodes of a policy, as an animation or a picture"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the behaviour, the task and the output file."""
    parser.add_argument("--task", metavar="T", help="default: the task of --policy")
    parser.add_argument(
        "--policy",
        type=path,
        metavar="CELL",
        help="finished cell whose final policy is used, also RESULTS.zip/... or reference/...",
    )
    parser.add_argument(
        "--behaviour", choices=("random", "script"), help="used without --policy; default: the task's script"
    )
    parser.add_argument(
        "--out", type=out_file, required=True, metavar="FILE", help="output file, .gif (animation) or .png (picture)"
    )
    parser.add_argument(
        "--episodes", type=OfKind(Episodes), default=4, metavar="N", help="number of episodes; default: 4"
    )
    parser.add_argument("--seed", type=OfKind(Seed), default=0, help="seed of random behaviour; default: 0")


def run(options: argparse.Namespace, console: Console) -> int:
    """Draw the episodes and print the path."""
    from codesign_bench.evaluation.rendering import render
    from codesign_bench.seeding import generator
    from codesign_bench.storage.policies import policy_and_task
    from codesign_bench.task import Behaviour, load_task
    from codesign_bench.task.behaviours import RandomBehaviour

    if options.policy is None and options.task is None:
        raise UserError("render: give --policy or --task")
    if options.policy is not None and options.behaviour is not None:
        raise UserError("render: give either --policy or --behaviour, not both")
    behaviour: Behaviour
    if options.policy is not None:
        behaviour, task = policy_and_task(options.policy, options.task)
    else:
        task = load_task(options.task)
        random = options.behaviour == "random"
        behaviour = RandomBehaviour(task, generator(options.seed, "render")) if random else task.script()
    printer(console)(render(task, behaviour, options.out, options.episodes))
    return 0
