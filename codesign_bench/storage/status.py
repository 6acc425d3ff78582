"""How far a cell is, as one line of text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from codesign_bench.console import number
from codesign_bench.storage.results import CURVE_FILE


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


def last_line(failure: dict[str, str]) -> str:
    """Return the last line of a failure's traceback, or its message where there is none."""
    lines = failure["traceback"].strip().splitlines()
    return lines[-1] if lines else failure["message"]


def _last_evaluation(folder: Path) -> dict[str, float]:
    import pandas as pd  # takes a second, which `--help` would pay

    try:
        return {str(name): float(value) for name, value in pd.read_csv(folder / CURVE_FILE).iloc[-1].items()}
    except (OSError, ValueError, IndexError):
        return {}
