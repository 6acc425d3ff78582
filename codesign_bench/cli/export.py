"""`codesign-bench export`: write a policy's tools as printable meshes."""

from __future__ import annotations

import argparse
import re
from typing import Annotated

from rich.console import Console

from codesign_bench.cli.arguments import OfKind, out_folder, path
from codesign_bench.config.values import Within
from codesign_bench.console import printer

Scale = Annotated[float, Within(0.0, 1_000.0, open_low=True)]
HELP = "write a policy's tools as printable meshes"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the policy, the instances whose tools are written, and the folder."""
    # argparse would read a value such as `-0.2,0.7` as an option: its own pattern matches single numbers only.
    parser._negative_number_matcher = re.compile(r"^-\.?\d")
    parser.add_argument(
        "--policy",
        type=path,
        required=True,
        metavar="CELL",
        help="finished cell, also RESULTS.zip/... or reference/...",
    )
    parser.add_argument("--task", metavar="T", help="default: the task of --policy")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--start", metavar="X,Y", help="the tool for an object that starts at this position, m")
    which.add_argument("--goal", metavar="G,...", help="the tool for this goal, in the task's units")
    which.add_argument(
        "--instances", metavar="N,...", help="tools for these evaluation instances; default: all of them"
    )
    parser.add_argument("--scale", type=OfKind(Scale), default=1.0, metavar="S", help="scale of the print; default: 1")
    parser.add_argument("--out", type=out_folder, required=True, metavar="DIR", help="output folder")


def run(options: argparse.Namespace, console: Console) -> int:
    """Write the tools."""
    from codesign_bench.fabrication.export import ALL, Order, export
    from codesign_bench.storage.policies import policy_and_task

    policy, task = policy_and_task(options.policy, options.task)
    given = {name: getattr(options, name) for name in ("start", "goal", "instances")}
    if all(value is None for value in given.values()):
        given["instances"] = ALL
    order = Order.of(task, **given, scale=options.scale)
    export(task, policy, order, options.out, printer(console), str(options.policy))
    return 0
