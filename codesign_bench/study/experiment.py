"""What one figure or table needs: cells, in stages, and what is measured with finished policies."""

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
"""Makes what no cell holds, unless it is there: results folder, name of the profile, what shows the user a line."""


@dataclass(frozen=True)
class Grid:
    """Cells of an experiment: tasks x methods x variants x seeds."""

    tasks: tuple[str, ...]
    methods: tuple[str, ...]
    seeds: tuple[int, ...] | Mapping[str, tuple[int, ...]]
    """Seeds of every cell, or those of each task by its name."""
    variants: tuple[Variant, ...] = (DEFAULT,)
    overrides: tuple[str, ...] = ()
    """Settings other than the profile's, in the form of `--set`."""

    def cells(self, profile: str, count: int | None = None) -> list[Cell]:
        """Return the cells under a profile; `count` overrides how many seeds there are."""
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
        if count is not None:  # more seeds than the study has follow its last one
            return (*seeds, *range(seeds[-1] + 1, seeds[-1] + 1 + count))[:count]
        return seeds[: profile_named(profile).most_seeds]


@dataclass(frozen=True)
class Experiment:
    """What one figure or table needs. One that needs no cells is drawn from the code itself, or from measurements."""

    figures: tuple[str, ...]
    """Names of figures that show it."""
    source: str
    """Where it comes from: a section, a figure or a table of a paper, or "ours"."""
    stages: tuple[tuple[Grid, ...], ...] = ()
    """Grids to run, one stage after the other; cells of a later stage may start from policies of an earlier one."""
    measures: tuple[Measure, ...] = ()
    """What is measured after the cells have run."""
    plays: bool = False
    """Whether its claims are judged by playing finished policies and scripts, too."""


def stages_of(experiments: Sequence[Experiment], profile: str, seeds: int | None = None) -> list[list[Cell]]:
    """Return the cells of several experiments, each once, stage by stage."""
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
