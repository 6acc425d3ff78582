"""Data sources of figures: the request to a source, and sources that several figures share.

A figure sets `SOURCE` to its source, a function of a `Request`. A source of a single figure may be in its file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from codesign_bench.console import Log, silent
from codesign_bench.errors import UserError
from codesign_bench.registry import in_order
from codesign_bench.storage.archive import is_archive
from codesign_bench.storage.cells import reported_cells
from codesign_bench.storage.frames import load_evaluations, stored_curves
from codesign_bench.storage.reference_points import with_reference_points

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Request:
    """The request of a figure to its source."""

    results: Path
    """The results folder."""
    log: Log = silent
    """Prints a line, e.g. on what is left out."""
    named: bool = False
    """Whether the user named the figure."""
    tasks: tuple[str, ...] = ()
    """Tasks that a named figure shows although there are no cells of theirs: those of the study."""

    @property
    def may_measure(self) -> bool:
        """Whether missing data may be measured, which can take minutes, and kept beside the cells."""
        return self.named and not is_archive(self.results)


Source: TypeAlias = "Callable[[Request], pd.DataFrame]"
"""Returns the frame for a figure; raises `UserError` if data are missing."""


def curves(request: Request) -> pd.DataFrame:
    """Return the learning curves of all cells, as `codesign_bench.load_results` does."""
    return stored_curves(request.results)


def curves_with_references(request: Request) -> pd.DataFrame:
    """Return the learning curves of all cells, with the reference points of their tasks in columns if there are any.

    `reference_points_in` reads the points.
    """
    return with_reference_points(stored_curves(request.results), request.results)


def final_curves(request: Request) -> pd.DataFrame:
    """Return the same of finished cells alone, for figures about the end of training."""
    return with_reference_points(stored_curves(request.results, finished=True), request.results)


def evaluations(request: Request) -> pd.DataFrame:
    """Return the final result of every finished cell on each evaluation instance."""
    return load_evaluations(request.results)


def design_sensitivity(request: Request) -> pd.DataFrame:
    """Return the outcome of many tools on many goals; if the figure was named, missing tasks are measured."""
    from codesign_bench.evaluation.sensitivity import load_sensitivity, measure_missing

    if request.may_measure:
        measure_missing(request.results, tasks_shown(request), request.log)
    return load_sensitivity(request.results)


def headroom(request: Request) -> pd.DataFrame:
    """Return what other tools earn with the controllers of finished cells, and the best that is known."""
    from codesign_bench.storage.headroom import load_headroom

    return load_headroom(request.results)


def design_values(request: Request) -> pd.DataFrame:
    """Return the tools that policies judged and that were played, one row per cell, instance and tool."""
    from codesign_bench.storage.headroom import load_design_values

    return load_design_values(request.results)


def timing(request: Request) -> pd.DataFrame:
    """Return the training times of cells and the inference times of their policies."""
    from codesign_bench.evaluation.timing import timing_frame

    return timing_frame(request.results, request.log)


def trials_on_an_arm(request: Request) -> pd.DataFrame:
    """Return the trials of every deployed policy."""
    from codesign_bench.deployment.tables import load_deployment

    return load_deployment(request.results)


def tasks_shown(request: Request) -> list[str]:
    """Return the tasks that a figure of tasks shows: those with cells and, if it was named, those of the study.

    Raises:
        UserError: there are no cells, and it was not named.
    """
    if not request.named:
        return tasks_in(request.results)
    cells = reported_cells(request.results) if request.results.is_dir() else ()
    return in_order("tasks", {*request.tasks, *(cell.record.task for cell in cells)})


def tasks_in(results: Path) -> list[str]:
    """Return the tasks with cells in `results`.

    Raises:
        UserError: there is none.
    """
    found = list(dict.fromkeys(cell.record.task for cell in reported_cells(results)))
    if not found:
        raise UserError(f"no cells in '{results}' yet; give the figure's name to draw it without cells")
    return found
