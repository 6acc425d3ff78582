"""The progress of a cell as one line of text."""

from __future__ import annotations

from pathlib import Path

from codesign_bench.console import number
from codesign_bench.storage.cells import StoredCell


def status_row(out: Path, cell: StoredCell) -> tuple[str, ...]:
    """Return the columns of a cell's line: path below `out`, status, steps, budget, last return and success."""
    last = cell.last_evaluation()
    env_steps = max(int(last.get("env_steps", 0)), cell.record.env_steps)
    return (
        str(cell.folder.relative_to(out)),
        cell.status,
        f"{env_steps:,}",
        f"{cell.record.config.run['steps'].value:,}",
        number(last.get("return_mean")),
        number(last.get("success_rate")),
    )
