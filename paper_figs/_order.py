"""The order of tasks in figures."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from codesign_bench.studies.corl2023.scenes import SCENES


def task_order(tasks: Iterable[str]) -> list[str]:
    """Return the tasks in the paper's order, those of third parties last, by name."""
    present = set(tasks)
    return [name for name in SCENES if name in present] + sorted(present - set(SCENES))


def in_task_order(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of a frame with a column `task` in that order; rows of one task keep theirs."""
    rank = {name: position for position, name in enumerate(task_order(frame["task"]))}
    return frame.sort_values("task", key=lambda tasks: tasks.map(rank), kind="stable").reset_index(drop=True)
