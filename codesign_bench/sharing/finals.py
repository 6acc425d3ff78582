"""Final values of results: one entry for each method on each task in each variant, with every seed.

Shapes: `N` seeds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from codesign_bench.cell.axes import keeps_returns
from codesign_bench.registry import in_order
from codesign_bench.stats import Reference, normalized_score
from codesign_bench.storage.cells import StoredCell, reported_cells
from codesign_bench.storage.records import CellRecord

Scales = Mapping[tuple[str, int], Reference]
"""Task and its version -> the scale of its normalised score."""


@dataclass(frozen=True)
class Finals:
    """How the finished cells of a method on a task in a variant end."""

    returns: np.ndarray
    """(N,) mean return of the last evaluation."""
    successes: np.ndarray
    """(N,) success rate of the last evaluation."""
    records: tuple[CellRecord, ...]
    """Those of the cells, in the same order."""

    @property
    def scene(self) -> tuple[str, int]:
        """The task and its version."""
        return self.records[0].task, self.records[0].task_version

    @property
    def method(self) -> str:
        """The method."""
        return self.records[0].method

    @property
    def label(self) -> str:
        """The method's name in tables."""
        return self.records[0].label or self.method

    @property
    def variant(self) -> str:
        """The name of the variant."""
        return self.records[0].variant.name

    @property
    def env_steps(self) -> float:
        """Environment steps of a cell, mean over seeds."""
        return float(np.mean([record.env_steps for record in self.records]))

    def scores(self, scales: Scales) -> np.ndarray:
        """Return (N,) normalised scores; NaN without a scale, or if the variant has another reward."""
        scale = scales.get(self.scene) if keeps_returns(self.records[0].variant) else None
        return np.asarray(normalized_score(self.returns, scale))


def finals_of(results: Path) -> list[Finals]:
    """Return the final values of everything in a results folder, in the order of tasks and methods.

    Cells that are not finished, have a damaged file or were evaluated on validation instances are left out.

    Raises:
        UserError: the folder does not exist.
    """
    groups: dict[tuple[str, int, str, str], list[StoredCell]] = {}
    for cell in reported_cells(results):
        record = cell.record
        if cell.is_done and not cell.problems:
            key = (record.task, record.task_version, record.variant.name, record.method)
            groups.setdefault(key, []).append(cell)
    tasks = in_order("tasks", dict.fromkeys(task for task, *_ in groups))
    methods = in_order("methods", dict.fromkeys(method for *_, method in groups))
    keys = sorted(groups, key=lambda key: (tasks.index(key[0]), -key[1], key[2], methods.index(key[3])))
    return [_finals(groups[key]) for key in keys]


def _finals(cells: list[StoredCell]) -> Finals:
    ends = [cell.last_evaluation() for cell in cells]
    returns, successes = (np.array([end[name] for end in ends]) for name in ("return_mean", "success_rate"))
    return Finals(returns, successes, tuple(cell.record for cell in cells))
