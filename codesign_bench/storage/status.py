"""The progress of a cell: what its process tells of itself while it runs, and one line of text for any cell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from codesign_bench.console import number
from codesign_bench.storage.cells import StoredCell
from codesign_bench.storage.json_fields import number as json_number
from codesign_bench.storage.layout import PROGRESS_FILE
from codesign_bench.storage.reading import UnusableFile, read_json
from codesign_bench.storage.records import RUNNING


def read_progress(folder: Path, since: float = 0.0) -> dict[str, Any] | None:
    """Return what the process of a cell last reported of itself, or None if that cannot be read.

    Args:
        folder: the cell's.
        since: seconds since the epoch; an earlier report counts as none.
    """
    try:
        found = read_json(folder / PROGRESS_FILE)
        for name in ("updated", "env_steps", "steps", "steps_per_second"):
            json_number(found, name)
        return dict(found) if found["updated"] >= since else None
    except (OSError, UnusableFile, ValueError, KeyError, TypeError, AttributeError):
        return None


def env_steps_of(cell: StoredCell) -> int:
    """Return how far a cell is, in environment steps: by its last evaluation, its record, or its process."""
    progress = read_progress(cell.folder) if cell.status == RUNNING else None
    evaluated = int(cell.last_evaluation().get("env_steps", 0))
    return max(evaluated, cell.record.env_steps, 0 if progress is None else int(progress["env_steps"]))


def status_row(out: Path, cell: StoredCell) -> tuple[str, ...]:
    """Return the columns of a cell's line: path below `out`, status, steps, budget, last return and success."""
    last = cell.last_evaluation()
    return (
        str(cell.folder.relative_to(out)),
        cell.status,
        f"{env_steps_of(cell):,}",
        f"{cell.record.config.run['steps'].value:,}",
        number(last.get("return_mean")),
        number(last.get("success_rate")),
    )


def status_event(out: Path, cell: StoredCell) -> dict[str, Any]:
    """Return the same as `status_row` for programs, with the error of a failed cell."""
    last, failure = cell.last_evaluation(), cell.record.failure
    return {
        "cell": cell.folder.relative_to(out).as_posix(),
        "status": cell.status,
        "env_steps": env_steps_of(cell),
        "steps": cell.record.config.run["steps"].value,
        "return_mean": last.get("return_mean"),
        "success_rate": last.get("success_rate"),
        "failure": None if failure is None else failure.last_line,
    }
