"""What tests of several rooms build: cells on disk without training, sweeps of toy cells, entries of configurations."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pytest
from rich.console import Console

from codesign_bench.cell.cell import Cell, resolve_cells
from codesign_bench.cell.grid import grid
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.contract import Verdict
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate, rows
from codesign_bench.method import Array, load_method
from codesign_bench.storage.cells import table_checksums
from codesign_bench.storage.layout import CURVE_COLUMNS, CURVE_FILE, EVALUATION_FILE, write_rows
from codesign_bench.storage.policies import save_policy
from codesign_bench.storage.records import DONE, CellRecord
from codesign_bench.storage.tables import Content, Measurements
from codesign_bench.sweep.runner import run_sweep
from codesign_bench.task import load_task

Part = TypeVar("Part")

VERSION_0_1_0 = Path(__file__).parent / "data" / "version_0_1_0"
"""A results folder of version 0.1.0 with a policy in every finished cell; nothing was learned in it."""

BUDGET = StoredConfig(run={"steps": Sourced(1000, "default")}, method={"epochs": Sourced(4, "default")})
"""A configuration with one setting in each part."""


NOTHING_HAPPENED = {"return": 0.0, "success": 0, "episode_length": 1, "material": 0.0, "effort": 0.0}
"""A row of an evaluation."""


def offered(part: Callable[[], Part]) -> Part:
    """Return what `part` returns; skip the test where a task does without this part of it."""
    try:
        return part()
    except (UserError, NotImplementedError) as error:
        pytest.skip(f"does without: {error or part}")


def assert_kept(verdict: Verdict) -> None:
    """Assert that a member keeps a promise; skip the test where it lacks the part that the promise is about."""
    if verdict.left_out:
        pytest.skip(verdict.left_out)
    assert verdict.faults == (), verdict.check.promise


def store_cell(
    out: Path,
    *,
    task: str = "push",
    method: str = "gnn_ppo",
    seed: int = 0,
    variant: Variant = DEFAULT,
    status: str = DONE,
    curve: Sequence[Mapping[str, Any]] = (),
    evaluation: Sequence[Mapping[str, Any]] = (),
    **fields: Any,
) -> Path:
    """Write a cell below `out` as if it had run, and return its folder.

    Args:
        out: a results folder; it need not exist.
        task: a name; the task need not exist.
        method: a name; the method need not exist.
        seed: the cell's.
        variant: the cell's.
        status: of its record.
        curve: rows of its curve, with the columns that matter; others are 0. A finished cell has one row at least.
        evaluation: rows of its last evaluation, likewise.
        fields: further fields of its record.
    """
    folder = Cell(task, method, seed, variant).folder(out)
    folder.mkdir(parents=True)
    finished = status == DONE
    if curve := curve or ([{}] if finished else []):
        zeros = dict.fromkeys(CURVE_COLUMNS, 0.0)
        write_rows(folder / CURVE_FILE, [{**zeros, "env_steps": 0, **row} for row in curve], CURVE_COLUMNS)
    if evaluation := evaluation or ([{"return": curve[-1].get("return_mean", 0.0)}] if finished else []):
        write_rows(folder / EVALUATION_FILE, [{**NOTHING_HAPPENED, **row} for row in evaluation])
    record = {"label": method, "profile": "quick", "config": BUDGET, **fields}
    record |= {"checksums": table_checksums(folder)} if finished else {}
    CellRecord(task=task, method=method, seed=seed, variant=variant, status=status, **record).write(folder)
    return folder


def store_played_cell(out: Path, task: str, method: str, tensors: Mapping[str, Array], **fields: Any) -> Path:
    """Write a finished cell whose policy has these tensors, with its evaluation, as if it had been trained.

    Its method has its default settings; `fields` are further ones of `store_cell`.
    """
    config, loaded = StoredConfig(BUDGET.run, {}), load_task(task)
    policy = load_method(method).make_policy(loaded, load_method(method).config_class(), tensors)
    evaluation = evaluate(loaded, policy)
    given = {"config": config, "task_version": loaded.version, **fields}
    curve = [{"env_steps": 100, **evaluation.summary}]
    folder = store_cell(out, task=task, method=method, curve=curve, evaluation=list(rows(loaded, evaluation)), **given)
    save_policy(folder, policy, {})
    return folder


def store_table(path: Path, kind: Measurements, *rows: Mapping[str, Any]) -> Path:
    """Write a table beside the cells with the columns that matter, and return its path; others hold 1 or a word."""
    columns = {name: content for name, content in kind.form.columns.items() if "*" not in name}
    others = {name: "word" if content is Content.TEXT else 1 for name, content in columns.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_rows(path, [{**others, **row} for row in rows])
    return path


def write_files(folder: Path, files: Mapping[str, str]) -> None:
    """Write text files below a folder, given by their paths in it."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def rising(*returns: float, every: int = 100) -> list[dict[str, Any]]:
    """Return rows of a curve that goes through `returns`, one evaluation every so many environment steps."""
    return [{"env_steps": every * index, "return_mean": value} for index, value in enumerate(returns)]


def toy_cells(seeds: int = 1, **changes: Any) -> list[Cell]:
    """Return toy cells of 200 steps and 4 evaluations; the fixture `toy` makes their names known."""
    given = {"steps": 200, "overrides": ("evaluations=4",), **changes}
    return list(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(seeds), **given))


def sweep(cells: Sequence[Cell], out: Path, **options: Any) -> tuple[int, str]:
    """Run a sweep; return its exit code and what it printed."""
    console = Console(record=True, width=200, file=io.StringIO())
    code = run_sweep(resolve_cells(cells), out, console=console, **options)
    return code, console.export_text()
