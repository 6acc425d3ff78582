"""The files of a search: `tuning.csv` with every setting in every rung, `tuned.json` with the best settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

from codesign_bench.errors import UserError
from codesign_bench.storage.files import json_bytes, write_output
from codesign_bench.storage.json_fields import text
from codesign_bench.storage.layout import rows_bytes
from codesign_bench.storage.reading import UnusableFile, read_json
from codesign_bench.storage.tables import Content, Form, read_table
from codesign_bench.study.tuning import Tuning
from codesign_bench.tuning.scores import Score

TABLE_FILE, WINNERS_FILE = "tuning.csv", "tuned.json"
COLUMNS = ("task", "method", "setting", "rung", "steps", "seeds", "env_steps", "validation_return", "kept")
"""Columns of the table before those of the hyperparameters, which are empty where a method has none of the name."""

FORM = Form({"task": Content.TEXT, "method": Content.TEXT})


def check_tables(out: Path, tuning: Tuning) -> None:
    """Check that the tables in `out` may be replaced: that this search includes what they tell of.

    Raises:
        UserError: they tell of other tasks or methods, or cannot be read.
    """
    try:
        table = read_table(out / TABLE_FILE, FORM)
    except UnusableFile as error:
        raise UserError(f"cannot read '{out / TABLE_FILE}' ({error.reason}); give another --out") from error
    if table is None:
        return
    known = set(zip(table["task"], table["method"], strict=True))
    missing = sorted(known - set(product(tuning.tasks, tuning.methods)))
    if missing:
        others = ", ".join(f"{method} on {task}" for task, method in missing)
        raise UserError(f"'{out}' has a search for {others}, too: name all of them, or give another --out")


def write_table(out: Path, tuning: Tuning, scores: Sequence[Score], kept: Sequence[Score]) -> None:
    """Write one row per setting and rung; `kept` are those that went on, or won the last rung."""
    rows = [
        {
            "task": found.setting.task,
            "method": found.setting.method,
            "setting": found.setting.number,
            "rung": found.rung,
            "steps": found.steps,
            "seeds": " ".join(map(str, tuning.seeds)),
            "env_steps": found.env_steps,
            "validation_return": found.validation_return,
            "kept": int(any(found is other for other in kept)),
            **found.setting.values,
        }
        for found in scores
    ]
    write_output(f"--out {out}", out / TABLE_FILE, rows_bytes(rows, COLUMNS))


def spent(scores: Sequence[Score]) -> dict[str, int]:
    """Return the environment steps of the search for each method."""
    steps: dict[str, int] = {}
    for found in scores:
        steps[found.setting.method] = steps.get(found.setting.method, 0) + found.env_steps
    return steps


def write_winners(
    out: Path, header: Mapping[str, Any], tuning: Tuning, scores: Sequence[Score], winners: Sequence[Score]
) -> None:
    """Write the best setting of every method on every task, for `run --tuned`.

    Args:
        out: the results folder.
        header: what the file says of the search besides its size.
        tuning: the search.
        scores: of all rungs, for the steps that the search took.
        winners: the best scores of the last rung.
    """
    content = {
        **header,
        "tuning": asdict(tuning),
        "env_steps": spent(scores),
        "winners": [
            {
                "task": winner.setting.task,
                "method": winner.setting.method,
                "setting": winner.setting.number,
                "validation_return": winner.validation_return,
                "values": dict(winner.setting.values),
                "set": list(winner.setting.overrides),
            }
            for winner in winners
        ],
    }
    write_output(f"--out {out}", out / WINNERS_FILE, json_bytes(content))


def read_winners(path: Path) -> dict[tuple[str, str], tuple[str, ...]]:
    """Return (task, method) -> the best setting in the form of `--set`, from a file that `tune` wrote.

    Raises:
        UserError: there is no such file, or it is another one.
    """
    try:
        return dict(map(_winner, read_json(path)["winners"]))
    except UnusableFile as error:
        raise UserError(f"cannot read '{path}', which `codesign-bench tune` writes ({error.reason})") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"cannot read '{path}', which `codesign-bench tune` writes ({error})") from error


def _winner(entry: Any) -> tuple[tuple[str, str], tuple[str, ...]]:
    """Return task and method of an entry, and its settings."""
    overrides = {f"set {number}": override for number, override in enumerate(entry["set"])}
    return (text(entry, "task"), text(entry, "method")), tuple(text(overrides, place) for place in overrides)
