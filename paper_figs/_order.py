"""The order of tasks in figures, the same as in listings."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from codesign_bench.registry import in_order


def task_order(tasks: Iterable[str]) -> list[str]:
    """Return the tasks in the order of listings, unknown ones last, by name."""
    return in_order("tasks", tasks)


def in_task_order(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a frame with a column `task` in this order; the order within a task is kept."""
    rank = {name: position for position, name in enumerate(task_order(frame["task"]))}
    return frame.sort_values("task", key=lambda tasks: tasks.map(rank), kind="stable").reset_index(drop=True)
