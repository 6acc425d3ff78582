"""`codesign-bench show`: print the resolved configuration, every value with its source."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import add_config, check_once

HELP = "print the resolved configuration, every value with its source, its range and its range in tuning"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add method, task and configuration."""
    parser.add_argument("--method", required=True, metavar="M", help="a name that `list` shows")
    parser.add_argument("--task", required=True, metavar="T", help="a name that `list` shows")
    add_config(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Print every value of a cell's configuration with source, what it may be, and what `tune` searches."""
    from codesign_bench.cell.cell import Cell, resolve_cells
    from codesign_bench.config.run_settings import RunSettings
    from codesign_bench.config.search import ranges
    from codesign_bench.config.settings import METHOD, RUN
    from codesign_bench.config.validation import kinds_of
    from codesign_bench.config.values import described
    from codesign_bench.console import print_table

    check_once(options.overrides, steps=options.steps)
    cell = Cell(
        options.task,
        options.method,
        seed=0,
        profile=options.profile,
        steps=options.steps,
        overrides=tuple(options.overrides),
    )
    (resolved,) = resolve_cells([cell], plays=False)
    searched = {(METHOD, name): str(found) for name, found in ranges(resolved.config.method).items()}
    kinds = {RUN: kinds_of(RunSettings), METHOD: kinds_of(resolved.method_class.config_class)}
    rows = [("task", "version", str(resolved.task.version), resolved.task.name, "", "")]
    rows += [
        (part, name, str(value), source, described(kinds[part][name]), searched.get((part, name), ""))
        for part, settings in resolved.config.stored().parts.items()
        for name, (value, source) in settings.items()
    ]
    print_table(console, ("part", "name", "value", "source", "may be", "searched"), rows)
    return 0
