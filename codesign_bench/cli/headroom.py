"""`codesign-bench headroom`: what a policy's controller would earn with other tools."""

from __future__ import annotations

import argparse
from typing import Annotated

from rich.console import Console

from codesign_bench.cli.arguments import Jobs, OfKind, add_results, out_folder, path
from codesign_bench.config.values import Within
from codesign_bench.console import printer

HELP = "search better tools for a policy's own controller: what the designer misses, and what the controller cannot do"
Instances = Annotated[int, Within(1, 1_000_000)]
Candidates = Annotated[int, Within(0, 1_000_000)]
Tools = Annotated[int, Within(2, 10_000)]
Sigma = Annotated[float, Within(1e-12, 10.0)]
RandomTools = Annotated[int, Within(1, 10_000)]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the policies, the results folder, the instances and the budget of the search."""
    parser.add_argument(
        "--policy", nargs="+", type=path, required=True, metavar="CELL", help="folders of finished cells"
    )
    add_results(parser, out_folder)
    parser.add_argument(
        "--instances", type=OfKind(Instances), metavar="N", help="only the first N evaluation instances; default: all"
    )
    parser.add_argument(
        "--candidates", type=OfKind(Candidates), metavar="N", help="tools of CMA-ES for every instance; default: 240"
    )
    parser.add_argument("--popsize", type=OfKind(Tools), metavar="N", help="tools of a generation; default: 12")
    parser.add_argument(
        "--sigma0", type=OfKind(Sigma), metavar="S", help="initial standard deviation in [-1, 1]; default: 0.3"
    )
    parser.add_argument(
        "--random-tools", type=OfKind(RandomTools), metavar="N", help="random tools for every instance; default: 8"
    )
    parser.add_argument(
        "--jobs", type=OfKind(Jobs), default=1, metavar="N", help="processes that play side by side; default: 1"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Measure the instances that are missing, and print the means."""
    from codesign_bench.evaluation.headroom import Budget, measure_cell, summary
    from codesign_bench.text_tables import markdown

    log = printer(console)
    given = {name: getattr(options, name) for name in ("candidates", "popsize", "sigma0", "random_tools")}
    budget = Budget(**{name: value for name, value in given.items() if value is not None})
    paths = [
        measure_cell(folder, options.results, budget, log, instances=options.instances, jobs=options.jobs)
        for folder in options.policy
    ]
    header, rows = summary(paths)
    log(markdown(header, rows).rstrip())
    return 0
