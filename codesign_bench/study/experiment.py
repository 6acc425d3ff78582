"""Experiments: the cells of one figure or table, in stages, and measurements with finished policies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codesign_bench.cell.cell import Cell
from codesign_bench.cell.grid import grid
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.config.profiles import profile_named
from codesign_bench.console import Log

Measure = Callable[[Path, str, Log], object]
"""Measures what cells do not have, if missing; arguments: results folder, name of the profile, logger."""


@dataclass(frozen=True)
class Grid:
    """Cells of an experiment: tasks x methods x variants x seeds."""

    tasks: tuple[str, ...]
    methods: tuple[str, ...]
    seeds: tuple[int, ...] | Mapping[str, tuple[int, ...]]
    """Seeds for all tasks, or by task."""
    variants: tuple[Variant, ...] = (DEFAULT,)
    overrides: tuple[str, ...] = ()
    """Settings that override the profile's, in the form of `--set`."""

    def cells(self, profile: str, count: int | None = None) -> list[Cell]:
        """Return the cells under a profile; `count` overrides the number of seeds."""
        return [
            cell
            for task in self.tasks
            for cell in grid(
                tasks=[task],
                methods=self.methods,
                seeds=self._seeds_of(task, profile, count),
                variants=self.variants,
                profile=profile,
                overrides=self.overrides,
            )
        ]

    def _seeds_of(self, task: str, profile: str, count: int | None) -> tuple[int, ...]:
        seeds = self.seeds[task] if isinstance(self.seeds, Mapping) else self.seeds
        if count is not None:  # additional seeds follow the study's last one
            return (*seeds, *range(seeds[-1] + 1, seeds[-1] + 1 + count))[:count]
        return seeds[: profile_named(profile).most_seeds]


@dataclass(frozen=True)
class Experiment:
    """The needs of one figure or table. Without cells, it is drawn from the code itself or from measurements."""

    figures: tuple[str, ...]
    """Names of the figures that show it."""
    source: str
    """Source: a section, figure or table of a paper, or "ours"."""
    stages: tuple[tuple[Grid, ...], ...] = ()
    """Grids to run, stage by stage; cells of a later stage may start from policies of an earlier one."""
    measures: tuple[Measure, ...] = ()
    """Measurements after the cells have run."""
    plays: bool = False
    """Whether its claims also need measurements with finished policies or scripts."""


def stages_of(experiments: Sequence[Experiment], profile: str, seeds: int | None = None) -> list[list[Cell]]:
    """Return the cells of several experiments, without duplicates, stage by stage."""
    stages: list[list[Cell]] = []
    for index in range(max((len(experiment.stages) for experiment in experiments), default=0)):
        before = {cell for stage in stages for cell in stage}
        cells = [
            cell
            for experiment in experiments
            if index < len(experiment.stages)
            for part in experiment.stages[index]
            for cell in part.cells(profile, seeds)
        ]
        stages.append([cell for cell in dict.fromkeys(cells) if cell not in before])
    return stages
