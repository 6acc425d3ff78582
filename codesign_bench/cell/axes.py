"""Axes that cells vary: their values, and what these change in the problem and the configuration.

A study may define more axes; see `Study.axes`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar

from codesign_bench.cell.variant import Value, Variant
from codesign_bench.config.run_settings import VALIDATION, RunSettings
from codesign_bench.config.values import Share, Within, check_value, parse_value, printable
from codesign_bench.errors import UserError, unknown_name
from codesign_bench.method import Problem
from codesign_bench.registry import load_all
from codesign_bench.task import Task
from codesign_bench.task.episodes import Tradeoff


class Axis:
    """One quantity that cells may vary. A subclass or instance defines its effect; by default there is none."""

    name: ClassVar[str]
    """Column of frames, part of the variant's name, option of `run`."""
    kind: ClassVar[Any] = float
    """Kind of its values: float, int or str, with limits if any, as those of settings; see `config.values`."""
    metavar: ClassVar[str] = "X"
    help: ClassVar[str] = ""
    """Help of the option, in one line."""
    exclusive: ClassVar[str] = ""
    """Axes with the same word here are never varied together; a grid contains each separately."""
    keeps_returns: ClassVar[bool] = True
    """Whether cells are still judged by the task's own reward, on its evaluation instances."""

    def check(self, value: Value, task: Task) -> None:
        """Check that a value is of the axis's kind, and possible on `task`.

        Raises:
            UserError: it is not; names the value.
        """
        try:
            check_value(self.kind, value)
        except ValueError as error:
            raise UserError(f"--variant {self.name}={value}: expected {error}") from error

    def problem(self, problem: Problem, value: Value, run: RunSettings) -> Problem:
        """Return the learning problem of the cell's method."""
        return problem

    def overrides(self, value: Value) -> tuple[str, ...]:
        """Return the settings that the value implies, in the form of `--set`."""
        return ()

    def run_overrides(self, run: RunSettings) -> Mapping[str, tuple[Any, str]]:
        """Return run settings for any value of the axis, unless --steps sets them: name -> (value, source)."""
        return {}

    def pretrained(self, variant: Variant) -> Variant | None:
        """Return the variant whose final policy a cell starts from; None: from scratch."""
        return None


class Cutout(Axis):
    """Holds out the inner part of the training region (paper, section 5.2)."""

    name = "cutout"
    kind = Annotated[float, Within(0.0, 1.0, open_low=True, open_high=True)]
    metavar = "F"
    help = "hold out the inner fraction F of the goal region from training"

    def check(self, value: Value, task: Task) -> None:
        """Check that the fraction is in (0, 1) and that the task has positions."""
        super().check(value, task)
        task.in_cutout(task.evaluation_instances()[:1], float(value))

    def problem(self, problem: Problem, value: Value, run: RunSettings) -> Problem:
        """Hold out the cutout region from training."""
        return replace(problem, cutout=float(value))


class Alpha(Axis):
    """Adds the trade-off reward (paper, equation 1)."""

    name = "alpha"
    kind = Share
    metavar = "A"
    help = "add the trade-off reward with coefficient A"
    keeps_returns = False

    def problem(self, problem: Problem, value: Value, run: RunSettings) -> Problem:
        """Add the trade-off reward."""
        return replace(problem, tradeoff=Tradeoff(float(value), run.tradeoff_scale))


FOLDER_NAME = re.compile(r"[A-Za-z0-9+][A-Za-z0-9._+-]{0,99}")
"""Texts that may be values of an axis: they become a part of the name of a cell's folder."""
FINE_TUNING_INSTANCES = 8
"""Instances at a fine-tuning place (ours; the paper and version 0.1.0 have one)."""


class _OnePlace(Axis):
    """Trains only at one of the task's fine-tuning places."""

    kind = Annotated[int, Within(1, 10_000)]
    metavar = "N"
    exclusive = "instance"
    keeps_returns = False

    def check(self, value: Value, task: Task) -> None:
        """Check that the task has a place with this number."""
        count = len(task.fine_tuning_instances())
        if not 1 <= int(value) <= count:
            raise UserError(f"--{self.name} {value}: task '{task.name}' has fine-tuning places 1 to {count}")

    def overrides(self, value: Value) -> tuple[str, ...]:
        """Train and evaluate on several instances there."""
        return (f"run.fine_tuning_instances={FINE_TUNING_INSTANCES}",)

    def problem(self, problem: Problem, value: Value, run: RunSettings) -> Problem:
        """Train and evaluate on the instances of this place."""
        place = problem.task.fine_tuning_instances()[int(value) - 1]
        return replace(problem, instances=place[: run.fine_tuning_instances])

    def run_overrides(self, run: RunSettings) -> Mapping[str, tuple[Any, str]]:
        """Return the smaller budget for one place."""
        return {"steps": (run.fine_tuning_steps, "fine_tuning_steps")}


class Finetune(_OnePlace):
    """Fine-tunes the finished policy of the same cell without this axis at one place (paper, section 5.2)."""

    name = "finetune"
    help = "fine-tune the finished default cell at fine-tuning place N"

    def pretrained(self, variant: Variant) -> Variant | None:
        """Start from the cell without this axis."""
        return variant.without(self.name)


class Scratch(_OnePlace):
    """Trains from scratch at one place, as a comparison for fine-tuning (paper, section 5.2)."""

    name = "scratch"
    help = "train from scratch at fine-tuning place N"


class _OfTuning(Axis):
    """Numbers the cells of a search for settings; these are evaluated on validation instances, at start and end."""

    kind = Annotated[int, Within(0, 1_000_000)]
    metavar = "N"
    keeps_returns = False

    def overrides(self, value: Value) -> tuple[str, ...]:
        """Keep the cell from being reported, and evaluate it no more often than the search needs."""
        return (f"run.instances={VALIDATION}", "run.evaluations=1")


class Rung(_OfTuning):
    """A rung of successive halving: cells of later rungs are fewer and longer."""

    name = "rung"
    help = "rung N of a search for settings"


class Setting(_OfTuning):
    """One random setting of all searched hyperparameters."""

    name = "setting"
    help = "number N of the settings that a search draws"


BUILT_IN: Mapping[str, Axis] = {axis.name: axis for axis in (Cutout(), Alpha(), Finetune(), Scratch())}
"""Axes with an option of `run`."""
OF_TUNING: Mapping[str, Axis] = {axis.name: axis for axis in (Rung(), Setting())}
"""Axes of the cells of `tune`."""


def axis_named(name: str) -> Axis:
    """Return the axis `name`, built-in or of a study.

    Raises:
        UserError: an unknown axis.
    """
    if name in (own := {**BUILT_IN, **OF_TUNING}):  # without importing any study
        return own[name]
    known = axes()
    if name not in known:
        raise unknown_name("axis", name, known)
    return known[name]


def keeps_returns(variant: Variant) -> bool:
    """Return whether cells of a variant are judged by the task's own reward, on its evaluation instances.

    Of an axis that is not known here, nothing is known, so the answer is no.
    """
    try:
        return all(axis_named(axis).keeps_returns for axis, _ in variant)
    except UserError:
        return False


def axes() -> dict[str, Axis]:
    """Return all axes by name: the built-in ones, then those of every study."""
    added = (axis for _, study in load_all("studies", "STUDY") for axis in study.axes)
    return {**BUILT_IN, **OF_TUNING, **{axis.name: axis for axis in added}}


def parse_axis_value(name: str, text: str) -> Value:
    """Parse a value of the axis `name`.

    Raises:
        UserError: an unknown axis, or a value of the wrong type.
    """
    axis = axis_named(name)
    try:
        value: Value = parse_value(axis.kind, text)
        if isinstance(value, str) and not FOLDER_NAME.fullmatch(value):
            raise ValueError("letters, digits and any of . _ + - as a part of a folder's name")
    except ValueError as error:
        raise UserError(f"--variant {name}={printable(text)}: expected {error}") from error
    return value
