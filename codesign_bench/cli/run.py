"""`codesign-bench run`: train and evaluate a grid of cells, method x task x variant x seed."""

from __future__ import annotations

import argparse
import signal
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from rich.console import Console

from codesign_bench.cell.axes import BUILT_IN, parse_axis_value
from codesign_bench.cell.variant import Value
from codesign_bench.cli.arguments import (
    DEFAULT_RESULTS,
    OfKind,
    add_config,
    add_dry_run,
    add_jobs,
    add_json,
    add_out,
    add_same_code,
    add_sweep,
    add_tensorboard,
    check_device,
    check_once,
    chosen_methods,
    chosen_tasks,
    path,
)
from codesign_bench.config.run_settings import Device, PrecisionChoice
from codesign_bench.config.values import printable
from codesign_bench.console import printer
from codesign_bench.errors import UserError

if TYPE_CHECKING:
    from codesign_bench.cell.cell import Cell

HELP = "train and evaluate: method x task x variant x seed"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the grid of cells, their configuration, and how to run them."""
    parser.add_argument(
        "--method", required=True, nargs="+", metavar="M", help="names, all (the paper's five), or beyond (all others)"
    )
    parser.add_argument(
        "--task", required=True, nargs="+", metavar="T", help="names, all (the paper's six), or beyond (all others)"
    )
    parser.add_argument(
        "--seeds",
        default="1",
        metavar="N|A,B|A-B",
        help="a count (6 is 0-5), a list (0,3,5), a range (2-4), or both (0,3-5); default: 1, which is seed 0 alone",
    )
    add_config(parser)
    parser.add_argument(
        "--tuned", type=path, metavar="FILE", help="settings that `tune` found for each task and method (tuned.json)"
    )
    for axis in BUILT_IN.values():
        parser.add_argument(
            f"--{axis.name}", nargs="+", type=OfKind(axis.kind), default=[], metavar=axis.metavar, help=axis.help
        )
    parser.add_argument(
        "--variant",
        nargs="+",
        action="extend",
        default=[],
        metavar="AXIS=VALUE,...",
        help="vary an axis, e.g. one that a study or a package defines",
    )
    add_jobs(parser)
    parser.add_argument("--device", choices=get_args(Device), help="device for network updates; default: cpu")
    parser.add_argument(
        "--precision",
        choices=get_args(PrecisionChoice),
        help="auto: bfloat16 updates if the processor supports them; default: fp32",
    )
    add_out(parser, DEFAULT_RESULTS)
    add_sweep(parser)
    add_same_code(parser)
    add_json(parser)
    add_tensorboard(parser)
    add_dry_run(parser, "list what would run, be resumed or skipped, with the expected time and memory")


# Modules that import pandas or torch are imported inside functions, so that `list` and `--help` need neither.


def run(options: argparse.Namespace, console: Console) -> int:
    """Run the grid; return 0 if all of its cells are done, 1 if some failed."""
    from codesign_bench.cell.cell import resolve_cells
    from codesign_bench.cell.grid import grid, parse_seeds, variants_of
    from codesign_bench.sweep.runner import dry_run, run_sweep

    check_once(options.overrides, steps=options.steps, device=options.device, precision=options.precision)
    log = printer(console)
    cells = grid(
        tasks=chosen_tasks(options.task, log),
        methods=chosen_methods(options.method, log),
        seeds=parse_seeds(options.seeds),
        variants=variants_of(axis_values(options)),
        profile=options.profile,
        steps=options.steps,
        overrides=overrides(options),
    )
    resolved = resolve_cells(list(cells) if options.tuned is None else tuned_cells(cells, options.tuned))
    for device in {cell.config.run.device for cell in resolved}:
        check_device(device)
    settings = {"jobs": options.jobs, "retry_failed": options.retry_failed, "same_code": options.same_code}
    if options.dry_run:
        return dry_run(resolved, options.out, console=console, **settings)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops a sweep as Ctrl-C does
    where = {"backend": options.backend, "scheduler": options.scheduler}
    return run_sweep(resolved, options.out, console=console, tensorboard=options.tensorboard, **settings, **where)


def tuned_cells(cells: Iterable[Cell], path: Path) -> list[Cell]:
    """Return cells with the best settings that a search found for their task and method; `--set` overrides these.

    Raises:
        UserError: the file cannot be read, or the search was not of a cell's task and method.
    """
    from codesign_bench.tuning.results import read_winners

    found, chosen = read_winners(path), []
    for cell in cells:
        if (cell.task, cell.method) not in found:
            raise UserError(f"--tuned {path}: has no settings of '{cell.method}' on '{cell.task}'")
        chosen.append(replace(cell, overrides=(*found[cell.task, cell.method], *cell.overrides)))
    return chosen


def axis_values(options: argparse.Namespace) -> dict[str, list[Value]]:
    """Return the requested values of each axis: those of its own option, then those of `--variant`.

    Raises:
        UserError: an unknown axis, or a value of the wrong type.
    """
    values: dict[str, list[Value]] = {name: list(getattr(options, name)) for name in BUILT_IN}
    for text in options.variant:
        axis, equals, listed = text.partition("=")
        if not axis or not equals or not listed:
            raise UserError(f"--variant {printable(text)}: write it as AXIS=VALUE or AXIS=VALUE,VALUE")
        values.setdefault(axis, []).extend(parse_axis_value(axis, value) for value in listed.split(","))
    return values


def overrides(options: argparse.Namespace) -> list[str]:
    """Return the `--set` entries and those that `--device` and `--precision` stand for.

    `--precision` is dropped if none of the methods has this setting.
    """
    from dataclasses import fields

    from codesign_bench.machine import computes_in_bfloat16
    from codesign_bench.method import load_method

    result = list(options.overrides)
    if options.device is not None:
        result.append(f"device={options.device}")
    if options.precision is not None:
        chosen = "bf16" if options.precision == "auto" and computes_in_bfloat16() else "fp32"
        methods = chosen_methods(options.method)
        keys = {field.name for name in methods for field in fields(load_method(name).config_class)}
        result += [f"precision={chosen}"] if "precision" in keys else []
    return result
