"""A cell: one method, on one task, in one variant, with one seed. Plain values only, so that it travels as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

from codesign_bench.config import ResolvedConfig, check_overrides, resolve
from codesign_bench.episodes import Tradeoff
from codesign_bench.errors import UserError
from codesign_bench.method import Problem, load_method
from codesign_bench.task import load_task


@dataclass(frozen=True)
class Cell:
    """What one run is: where its results lie follows from task, method, variant and seed."""

    task: str
    method: str
    seed: int
    cutout: float | None = None
    """Fraction of the training region that is never trained on, or None."""
    alpha: float | None = None
    """Coefficient of the trade-off reward, or None for the task's reward alone."""
    profile: str = "laptop"
    steps: int | None = None
    """Budget in environment steps, or None for the profile's."""
    overrides: tuple[str, ...] = ()
    """`key=value` entries of `--set`."""

    @property
    def variant(self) -> str:
        """The name of the variant, e.g. `default`, `cutout-0.40`, `alpha-0.30`, `cutout-0.40_alpha-0.30`."""
        parts = (("cutout", self.cutout), ("alpha", self.alpha))
        return "_".join(f"{name}-{_two_digits(value)}" for name, value in parts if value is not None) or "default"

    @property
    def name(self) -> str:
        """Its path below the results folder, e.g. `push/gnn_ppo/default/seed-00`."""
        return f"{self.task}/{self.method}/{self.variant}/seed-{self.seed:02d}"

    def folder(self, out: Path) -> Path:
        """Return the folder of its results below `out`."""
        return out / self.name

    def config(self) -> ResolvedConfig:
        """Return its resolved configuration."""
        return resolve(load_method(self.method), self.task, self.profile, self.overrides, self.steps)

    def problem(self, config: ResolvedConfig) -> Problem:
        """Return what its method is asked to learn."""
        tradeoff = None if self.alpha is None else Tradeoff(self.alpha, config.run.tradeoff_scale)
        return Problem(load_task(self.task), cutout=self.cutout or 0.0, tradeoff=tradeoff)

    def to_json(self) -> str:
        """Return it as a line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Cell:
        """Return the cell that `to_json` wrote."""
        values = json.loads(text)
        return cls(**{**values, "overrides": tuple(values["overrides"])})


def grid(
    *,
    tasks: Sequence[str],
    methods: Sequence[str],
    seeds: Sequence[int],
    cutouts: Sequence[float] = (),
    alphas: Sequence[float] = (),
    profile: str = "laptop",
    steps: int | None = None,
    overrides: Sequence[str] = (),
) -> Iterator[Cell]:
    """Yield every cell of tasks x seeds x variants x methods; seeds come before methods, so that a sweep cut short
    has every method."""
    for task, seed, cutout, alpha, method in product(tasks, seeds, cutouts or (None,), alphas or (None,), methods):
        yield Cell(task, method, seed, cutout, alpha, profile, steps, tuple(overrides))


def check_cells(cells: Sequence[Cell]) -> None:
    """Refuse overrides that no method knows, and cutouts that a task cannot have.

    Raises:
        UserError: naming the first.
    """
    methods = [load_method(name) for name in dict.fromkeys(cell.method for cell in cells)]
    check_overrides(cells[0].overrides, methods)
    for task_name, cutout in dict.fromkeys((cell.task, cell.cutout) for cell in cells):
        task = load_task(task_name)
        if cutout is not None:
            task.in_cutout(task.evaluation_instances()[:1], cutout)


def parse_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds that `--seeds` means: `6` is 0 to 5, `0,3,5` a list, `2-4` a range.

    Raises:
        UserError: it is none of them, or empty, or negative.
    """
    try:
        if text.strip().isdigit():
            seeds = list(range(int(text)))
        else:
            seeds = [seed for part in text.split(",") for seed in _seed_range(part)]
    except ValueError:
        seeds = []
    if not seeds:
        raise UserError(f"--seeds: '{text}' is neither a count (6 is 0-5) nor a list (0,3,5) nor a range (2-4)")
    return tuple(dict.fromkeys(seeds))


def _seed_range(part: str) -> range:
    first, dash, last = part.partition("-")
    return range(int(first), int(last if dash else first) + 1)


def _two_digits(value: float) -> str:
    return f"{value:.2f}" if round(value, 2) == value else repr(value)
