"""What the command line tells without running anything: `list`, `show` and `status`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from codesign_bench.cell import Cell
from codesign_bench.config import check_overrides
from codesign_bench.errors import UserError
from codesign_bench.method import load_method
from codesign_bench.profiles import PROFILE_HELP
from codesign_bench.progress import number, print_table
from codesign_bench.registry import names
from codesign_bench.results import CURVE_FILE, FAILED, cell_status, find_cells
from codesign_bench.task import load_task


def print_list(console: Console) -> None:
    """Print the names of methods, tasks, figures and profiles; imports none of them."""
    for title, group in (("methods", "methods"), ("tasks", "tasks"), ("figures", "paper_figs")):
        console.print(title, markup=False, highlight=False)
        for name in names(group):
            console.print(f"  {name}", markup=False, highlight=False, soft_wrap=True)
    console.print("profiles", markup=False, highlight=False)
    for name, text in PROFILE_HELP.items():
        console.print(f"  {name:8} {text}", markup=False, highlight=False, soft_wrap=True)


def print_config(console: Console, cell: Cell) -> None:
    """Print every value of a cell's configuration with its source.

    Raises:
        UserError: an unknown task, method, profile or key.
    """
    load_task(cell.task)
    check_overrides(cell.overrides, [load_method(cell.method)])
    rows = [
        (part, name, str(entry["value"]), entry["source"])
        for part, entries in cell.config().as_json().items()
        for name, entry in entries.items()
    ]
    print_table(console, ("part", "name", "value", "source"), rows)


def print_status(console: Console, out: Path) -> None:
    """Print one line per cell below `out`, the counts, and why cells failed.

    Raises:
        UserError: there is no such folder, or no cell in it.
    """
    cells = [(folder, content, cell_status(folder, content)) for folder, content in find_cells(out)]
    if not cells:
        raise UserError(f"no cells in '{out}' yet; make some with: codesign-bench run --out {out}")
    rows = [status_row(out, folder, content, status) for folder, content, status in cells]
    print_table(console, ("cell", "status", "env_steps", "of", "return", "success"), rows)
    counts = Counter(status for _, _, status in cells)
    summary = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    console.print(f"{len(cells)} cells: {summary}", markup=False, highlight=False)
    for folder, content, status in cells:
        if status == FAILED:
            line = f"{folder.relative_to(out)}: {_last_line(content['failure'])}"
            console.print(line, markup=False, highlight=False, soft_wrap=True)


def status_row(out: Path, folder: Path, content: dict[str, Any], status: str) -> tuple[str, ...]:
    """Return a cell's line as text: path below `out`, status, steps, budget, last return and success."""
    last = _last_evaluation(folder)
    env_steps = max(int(last.get("env_steps", 0)), int(content["env_steps"]))
    return (
        str(folder.relative_to(out)),
        status,
        f"{env_steps:,}",
        f"{content['config']['run']['steps']['value']:,}",
        number(last.get("return_mean")),
        number(last.get("success_rate")),
    )


def _last_evaluation(folder: Path) -> dict[str, float]:
    try:
        return {str(name): float(value) for name, value in pd.read_csv(folder / CURVE_FILE).iloc[-1].items()}
    except (OSError, ValueError, IndexError):
        return {}


def _last_line(failure: dict[str, str]) -> str:
    lines = failure["traceback"].strip().splitlines()
    return lines[-1] if lines else failure["message"]
