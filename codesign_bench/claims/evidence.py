"""The data for judging claims: a results folder as frames, only from finished cells.

Shapes: `N` seeds, `G` evaluation instances.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.claims.finding import InsufficientData
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.deployment.tables import load_deployment
from codesign_bench.errors import UserError
from codesign_bench.evaluation.cutout_regions import load_cutout_regions
from codesign_bench.evaluation.extrapolation import load_outside
from codesign_bench.evaluation.sensitivity import load_sensitivity
from codesign_bench.stats import CELL_KEYS, MIN_SEEDS
from codesign_bench.storage.cells import reported_cells
from codesign_bench.storage.frames import load_evaluations, stored_curves
from codesign_bench.storage.layout import first_run
from codesign_bench.storage.reference_points import load_reference_points
from codesign_bench.task import load_task, task_names, usable_tasks

DESIGN_PREFIX = "design_"


@dataclass(frozen=True)
class Evidence:
    """Frames that may be empty; methods raise `InsufficientData` if data are missing."""

    curves: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.load_results`."""
    evaluations: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.storage.frames.load_evaluations`."""
    sensitivity: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.evaluation.sensitivity.measure` for several tasks."""
    outside: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.evaluation.extrapolation.load_or_measure`."""
    cutout_regions: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.evaluation.cutout_regions.load_cutout_regions`."""
    deployment: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.deployment.tables.load_deployment`."""
    design_widths: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Task -> column of a design parameter in `evaluations` -> width of its range, in the parameter's unit."""
    profile: str = DEFAULT_PROFILE
    """The profile of the cells, if it is the same for all, so that commands for missing data match them."""
    references: pd.DataFrame = field(default_factory=pd.DataFrame)
    """Rows of `codesign_bench.storage.reference_points.load_reference_points`, for the task versions of the cells."""

    @property
    def tasks(self) -> set[str]:
        """Names of the tasks with any data."""
        frames = (self.curves, self.evaluations, self.sensitivity, self.outside, self.cutout_regions, self.deployment)
        return {str(task) for frame in frames if len(frame) for task in frame["task"].unique()}

    @property
    def first_seed(self) -> int:
        """The least seed of the finished cells that vary nothing, from which commands for missing data count; 0 if
        there are none."""
        rows = self.evaluations
        own = rows[rows["variant"] == DEFAULT.name] if len(rows) else rows
        return int(own["seed"].min()) if len(own) else 0

    def methods(self, task: str) -> list[str]:
        """Return the names of the methods with finished cells that vary nothing on a task."""
        rows = self.evaluations
        if rows.empty:
            return []
        own = rows[(rows["task"] == task) & (rows["variant"] == DEFAULT.name)]
        return sorted({str(method) for method in own["method"]})

    def instances(self, task: str, method: str, variant: Variant = DEFAULT) -> pd.DataFrame:
        """Return the final evaluation of the finished cells of one method, task and variant, one row per instance.

        Raises:
            InsufficientData: there are fewer than `MIN_SEEDS` finished seeds.
        """
        rows = _select(self.evaluations, task, method, variant)
        seeds = rows["seed"].nunique() if len(rows) else 0
        if seeds < MIN_SEEDS:
            counted = f"{seeds} finished seed{'' if seeds == 1 else 's'}"
            raise InsufficientData(f"{counted} of {task}/{method}/{variant.name}; {MIN_SEEDS} are needed")
        return rows

    def seeds(self, task: str, method: str) -> list[int]:
        """Return the seeds of a method's finished cells that vary nothing on a task, in ascending order."""
        rows = _select(self.evaluations, task, method, DEFAULT)
        return sorted({int(seed) for seed in rows["seed"]}) if len(rows) else []

    def final_returns(self, task: str, method: str, variant: Variant = DEFAULT) -> np.ndarray:
        """Return the mean return over evaluation instances at the end of training, (N,).

        Raises:
            InsufficientData: as `instances` does.
        """
        return self.instances(task, method, variant).groupby("seed")["return"].mean().to_numpy()

    def final_successes(self, task: str, method: str, variant: Variant = DEFAULT) -> np.ndarray:
        """Return the success rate on evaluation instances at the end of training, (N,).

        Raises:
            InsufficientData: as `instances` does.
        """
        return self.instances(task, method, variant).groupby("seed")["success"].mean().to_numpy()

    def curve(self, task: str, method: str, variant: Variant = DEFAULT) -> pd.DataFrame:
        """Return the learning curves of the finished cells of one method, task and variant.

        Raises:
            InsufficientData: as `instances` does, or a finished cell lacks its curve.
        """
        finished = self.instances(task, method, variant)["seed"].unique()
        rows = _select(self.curves, task, method, variant)
        if not len(rows) or not set(finished) <= set(rows["seed"]):
            raise InsufficientData(f"a finished cell of {task}/{method}/{variant.name} has no curve")
        return rows[rows["seed"].isin(finished)]

    def budget(self, task: str, method: str, variant: Variant = DEFAULT) -> float:
        """Return the mean environment steps at the end of training over finished seeds.

        Raises:
            InsufficientData: as `curve` does.
        """
        return float(self.curve(task, method, variant).groupby("seed")["env_steps"].max().mean())


def _select(frame: pd.DataFrame, task: str, method: str, variant: Variant) -> pd.DataFrame:
    """Return the rows of one method, task and variant."""
    if frame.empty:
        return frame
    wanted = pd.Series(True, index=frame.index)
    for column, value in zip(CELL_KEYS, (task, method, variant.name), strict=True):
        wanted &= frame[column] == value
    return frame[wanted]


def load_evidence(results: Path) -> Evidence:
    """Read the data for judging claims from a results folder.

    Raises:
        UserError: the folder does not exist, or has neither a finished cell nor a design-sensitivity table.
    """
    records = [cell.record for cell in reported_cells(results)]
    profiles = {record.profile for record in records}
    curves = _read(stored_curves, results)
    evaluations = _read(load_evaluations, results)
    sensitivity = _read(load_sensitivity, results)
    outside = _read(load_outside, results)
    regions = _read(load_cutout_regions, results)
    deployment = _read(load_deployment, results)
    points = _read(load_reference_points, results)
    references = _of_versions(points, {(record.task, record.task_version) for record in records})
    if evaluations.empty and sensitivity.empty:
        raise UserError(f"no finished cell in '{results}' yet; create some with: {first_run(results)}")
    profile = profiles.pop() if len(profiles) == 1 else DEFAULT_PROFILE
    widths = _design_widths(evaluations)
    return Evidence(curves, evaluations, sensitivity, outside, regions, deployment, widths, profile, references)


def _read(read: Callable[[Path], pd.DataFrame], results: Path) -> pd.DataFrame:
    """Return a frame, empty if there is none that can be used; the claims that need it report this."""
    try:
        return read(results)
    except UserError:
        return pd.DataFrame()


def _of_versions(points: pd.DataFrame, played: set[tuple[str, int]]) -> pd.DataFrame:
    """Return the reference points of tasks whose cells, each (task, version), are all of the version of the points."""
    if points.empty:
        return points
    versions = zip(points["task"], points["task_version"], strict=True)
    return points[[{own for own in played if own[0] == task} <= {(task, int(version))} for task, version in versions]]


def _design_widths(evaluations: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Return the ranges of the design parameters of the known tasks in `evaluations`."""
    present = set(evaluations["task"]) if len(evaluations) else set()
    widths = {}
    for name in usable_tasks(name for name in task_names() if name in present):
        space = load_task(name).design_space
        low, high = space.bounds
        pairs = zip(space.names, (high - low).tolist(), strict=True)
        widths[name] = {f"{DESIGN_PREFIX}{parameter}": width for parameter, width in pairs}
    return widths
