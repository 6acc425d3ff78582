"""`codesign-bench run`: train and evaluate a grid of cells, method x task x variant x seed."""

from __future__ import annotations

import argparse
import signal

from rich.console import Console

from codesign_bench.cli.arguments import (
    DEFAULT_RESULTS,
    add_config,
    add_jobs,
    add_out,
    check_at_least_one,
    chosen_names,
    integer,
)
from codesign_bench.config.profiles import DEVICES, PRECISIONS, check_fractions
from codesign_bench.errors import UserError
from codesign_bench.registry import names

HELP = "train and evaluate: method x task x variant x seed"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the grid, the configuration, and how to run it."""
    parser.add_argument("--method", required=True, nargs="+", metavar="M", help="names, or all: the paper's five")
    parser.add_argument("--task", required=True, nargs="+", metavar="T", help="names, or all")
    parser.add_argument("--seeds", default="1", help="a count (6 is 0-5), a list (0,3,5) or a range (2-4); default: 1")
    add_config(parser)
    parser.add_argument(
        "--cutout",
        nargs="+",
        type=float,
        default=[],
        metavar="F",
        help="hold out the inner fraction F of the goal region from training",
    )
    parser.add_argument("--alpha", nargs="+", type=float, default=[], metavar="A", help="trade-off coefficients")
    parser.add_argument(
        "--finetune",
        nargs="+",
        type=integer,
        default=[],
        metavar="N",
        help="fine-tune the finished default cell on fine-tuning instance N",
    )
    parser.add_argument(
        "--scratch",
        nargs="+",
        type=integer,
        default=[],
        metavar="N",
        help="train from scratch on fine-tuning instance N",
    )
    add_jobs(parser)
    parser.add_argument("--device", choices=DEVICES, help="where networks are updated; default: cpu")
    parser.add_argument(
        "--precision", choices=PRECISIONS, help="auto: bfloat16 updates where the processor supports it; default: fp32"
    )
    add_out(parser, DEFAULT_RESULTS)
    parser.add_argument("--backend", default="loky", choices=("loky", "dask"), help="default: loky, this machine")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of a running Dask scheduler (default: start a local cluster)"
    )
    parser.add_argument("--retry-failed", action="store_true", help="run failed cells again")


# Imports that need pandas or torch stand where they are used, so that `list` and `--help` need neither.


def run(options: argparse.Namespace, console: Console) -> int:
    """Run the grid; 0 if all of its cells are done in the end, 1 if some failed."""
    from codesign_bench.cell.cell import check_cells, grid, parse_seeds
    from codesign_bench.sweep.runner import run_sweep

    check_at_least_one(options, "steps", "jobs")
    check_fractions(options.cutout, options.alpha)
    cells = list(
        grid(
            tasks=chosen_names("tasks", options.task, names("tasks")),
            methods=chosen_names("methods", options.method, paper_methods()),
            seeds=parse_seeds(options.seeds),
            cutouts=list(dict.fromkeys(options.cutout)),
            alphas=list(dict.fromkeys(options.alpha)),
            finetunes=list(dict.fromkeys(options.finetune)),
            scratches=list(dict.fromkeys(options.scratch)),
            profile=options.profile,
            steps=options.steps,
            overrides=overrides(options),
        )
    )
    check_cells(cells)
    _check_device(cells[0].config().run.device)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops a sweep as Ctrl-C does.
    return run_sweep(
        cells,
        options.out,
        console=console,
        jobs=options.jobs,
        retry_failed=options.retry_failed,
        backend=options.backend,
        scheduler=options.scheduler,
    )


def overrides(options: argparse.Namespace) -> list[str]:
    """Return the `--set` entries, and those that `--device` and `--precision` stand for, where a method has any use."""
    from dataclasses import fields

    from codesign_bench.machine import computes_in_bfloat16
    from codesign_bench.method import load_method

    result = list(options.overrides)
    if options.device is not None:
        result.append(f"device={options.device}")
    if options.precision is not None:
        chosen = "bf16" if options.precision == "auto" and computes_in_bfloat16() else "fp32"
        methods = chosen_names("methods", options.method, paper_methods())
        keys = {field.name for name in methods for field in fields(load_method(name).config_class)}
        result += [f"precision={chosen}"] if "precision" in keys else []
    return result


def paper_methods() -> list[str]:
    """Return what `--method all` means: the built-in methods that the methods folder itself orders."""
    from importlib import import_module

    return list(import_module("codesign_bench.methods").ORDER)


def _check_device(device: str) -> None:
    """Refuse a GPU that is not there: `--device` and `--set device` alike."""
    if device == "cuda":
        import torch

        if not torch.cuda.is_available():
            raise UserError("--device cuda: torch finds no such device here; choose cpu")
