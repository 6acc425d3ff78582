"""A cell: one method, on one task, in one variant, with one seed. Plain values only, so that it travels as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

from codesign_bench.config.resolve import ResolvedConfig, check_overrides, resolve
from codesign_bench.errors import UserError
from codesign_bench.method import Problem, load_method
from codesign_bench.storage.results import DEFAULT_VARIANT
from codesign_bench.task import load_task
from codesign_bench.task.episodes import Tradeoff


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
    finetune: int | None = None
    """Number, from 1, of the task's fine-tuning instance to go on with from the finished default cell, or None."""
    scratch: int | None = None
    """Number of the fine-tuning instance to learn from scratch, or None."""
    profile: str = "laptop"
    steps: int | None = None
    """Budget in environment steps, or None for the profile's."""
    overrides: tuple[str, ...] = ()
    """`key=value` entries of `--set`."""

    @property
    def variant(self) -> str:
        """The name of the variant, e.g. `default`, `cutout-0.40`, `cutout-0.40_alpha-0.30`, `finetune-1`."""
        parts = [f"{name}-{_two_digits(value)}" for name, value in self._shares if value is not None]
        parts += [f"{name}-{number}" for name, number in self._numbers if number is not None]
        return "_".join(parts) or DEFAULT_VARIANT

    @property
    def _shares(self) -> tuple[tuple[str, float | None], ...]:
        return (("cutout", self.cutout), ("alpha", self.alpha))

    @property
    def _numbers(self) -> tuple[tuple[str, int | None], ...]:
        return (("finetune", self.finetune), ("scratch", self.scratch))

    @property
    def start(self) -> int | None:
        """The number of its fine-tuning instance, or None."""
        return self.scratch if self.finetune is None else self.finetune

    @property
    def name(self) -> str:
        """Its path below the results folder, e.g. `push/gnn_ppo/default/seed-00`."""
        return f"{self.task}/{self.method}/{self.variant}/seed-{self.seed:02d}"

    def folder(self, out: Path) -> Path:
        """Return the folder of its results below `out`."""
        return out / self.name

    def config(self) -> ResolvedConfig:
        """Return its resolved configuration."""
        config = resolve(load_method(self.method), self.task, self.profile, self.overrides, self.steps)
        if self.start is None or self.steps is not None:
            return config
        run = replace(config.run, steps=config.run.fine_tuning_steps)
        return replace(config, run=run, sources={**config.sources, "run.steps": "fine_tuning_steps"})

    def pretrained(self) -> Cell:
        """Return the default cell that a fine-tuning cell goes on from."""
        return replace(self, finetune=None)

    def pretrained_folder(self, folder: Path) -> Path:
        """Return the folder of the default cell that the fine-tuning cell in `folder` goes on from."""
        return folder.parent.parent / self.pretrained().variant / folder.name

    def problem(self, config: ResolvedConfig) -> Problem:
        """Return what its method is asked to learn."""
        tradeoff = None if self.alpha is None else Tradeoff(self.alpha, config.run.tradeoff_scale)
        task = load_task(self.task)
        instances = None if self.start is None else task.fine_tuning_instances()[self.start - 1 : self.start]
        return Problem(task, cutout=self.cutout or 0.0, tradeoff=tradeoff, instances=instances)

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
    finetunes: Sequence[int] = (),
    scratches: Sequence[int] = (),
    profile: str = "laptop",
    steps: int | None = None,
    overrides: Sequence[str] = (),
) -> Iterator[Cell]:
    """Yield every cell of tasks x seeds x variants x methods; seeds come before methods, so that a sweep cut short
    has every method."""
    starts: list[tuple[int | None, int | None]] = [(number, None) for number in finetunes]
    starts += [(None, number) for number in scratches]
    variants = product(cutouts or (None,), alphas or (None,), starts or [(None, None)])
    for task, seed, (cutout, alpha, (finetune, scratch)), method in product(tasks, seeds, list(variants), methods):
        yield Cell(task, method, seed, cutout, alpha, finetune, scratch, profile, steps, tuple(overrides))


def check_cells(cells: Sequence[Cell]) -> None:
    """Refuse overrides that no method knows, and cutouts and fine-tuning instances that a task cannot have.

    Raises:
        UserError: naming the first.
    """
    methods = [load_method(name) for name in dict.fromkeys(cell.method for cell in cells)]
    check_overrides(cells[0].overrides, methods)
    for task_name, cutout in dict.fromkeys((cell.task, cell.cutout) for cell in cells):
        task = load_task(task_name)
        if cutout is not None:
            task.in_cutout(task.evaluation_instances()[:1], cutout)
    for task_name, number in dict.fromkeys((cell.task, cell.start) for cell in cells):
        if number is not None and not 1 <= number <= (count := len(load_task(task_name).fine_tuning_instances())):
            raise UserError(f"fine-tuning instance {number}: task '{task_name}' has 1 to {count}")


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
