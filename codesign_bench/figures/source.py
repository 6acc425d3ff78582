"""Where figures get their numbers: what a source is asked, and the sources that several figures share.

A figure names its source as `SOURCE`, a function of a `Request`. One that no other figure has may stand in its file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from codesign_bench.console import Log, silent
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.frames import load_evaluations, load_results

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Request:
    """What a figure asks of its source."""

    results: Path
    """The results folder."""
    log: Log = silent
    """Shows the user a line, e.g. about what is left out."""
    named: bool = False
    """Whether the user named the figure: then what is missing may be measured, which can take minutes."""


Source: TypeAlias = "Callable[[Request], pd.DataFrame]"
"""Returns the frame that a figure is drawn from; raises `UserError` where the results lack something."""


def curves(request: Request) -> pd.DataFrame:
    """Return the learning curves of all cells, as `codesign_bench.load_results` does."""
    return load_results(request.results)


def evaluations(request: Request) -> pd.DataFrame:
    """Return what every finished cell reached on each evaluation instance."""
    return load_evaluations(request.results)


def design_sensitivity(request: Request) -> pd.DataFrame:
    """Return the outcome of many tools on many goals; if the figure was named, missing tasks are measured."""
    from codesign_bench.evaluation.sensitivity import load_sensitivity, measure_missing
    from codesign_bench.task import task_names

    if request.named:
        measure_missing(request.results, task_names(), request.log)
    return load_sensitivity(request.results)


def timing(request: Request) -> pd.DataFrame:
    """Return how long cells took to train, and how long their policies take to act."""
    from codesign_bench.evaluation.timing import timing_frame

    return timing_frame(request.results)


def trials_on_an_arm(request: Request) -> pd.DataFrame:
    """Return the trials of one deployed policy for each task, that of the lowest seed."""
    from codesign_bench.deployment.tables import SEED, load_deployment

    trials = load_deployment(request.results)
    return trials[trials[SEED] == trials.groupby("task")[SEED].transform("min")]


def tasks_in(results: Path) -> list[str]:
    """Return the tasks of which results hold cells.

    Raises:
        UserError: there is none.
    """
    found = list(dict.fromkeys(cell.record.task for cell in find_cells(results)))
    if not found:
        raise UserError(f"no cells in '{results}' yet; name the figure to draw it without any")
    return found
