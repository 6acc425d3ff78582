"""How a study searches the settings of its methods: a random search of the same size for every method on every task.

Successive halving (Jamieson and Talwalkar 2016) gives most steps to the settings that do well: after each rung, one
setting in `eta` goes on to a budget `eta` times as large. Every rung trains from the start. Continuing the cells of the
last rung would be cheaper, but learning rates decrease over the budget, so a continued cell would not be the cell that
the larger budget gives.

Where compute is short, a search may start from the settings that are there (`spread`), play less than the budget
(`share`) and choose one change for all tasks (`pooled`): a seed on each of eight tasks then decides instead of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from codesign_bench.seeding import TUNING_SEEDS

FIRST_REPORTED_SEED = 100
"""First seed of experiments that report results of tuned settings; such seeds were never used in tuning."""


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """The search for settings: the same number of settings and the same steps for every method on every task."""

    methods: tuple[str, ...]
    tasks: tuple[str, ...]
    settings: int
    """Settings that start, for every method on every task."""
    rungs: int = 3
    eta: int = 3
    """One setting in `eta` goes on to the next rung, whose budget is `eta` times as large."""
    seeds: tuple[int, ...] = (0, 1)
    """Seeds of every setting, some of `TUNING_SEEDS`; the mean over them counts."""
    draw: int = 0
    """Seed from which the settings are drawn."""
    spread: float | None = None
    """Share of each range, around the profile's value, from which settings are drawn; the profile's own settings are
    the first of them. None: settings are drawn from the whole ranges, and the profile's are not among them."""
    share: float = 1.0
    """Budget of the last rung, as a share of the profile's."""
    pooled: bool = False
    """Whether a method's settings of the same number go on together on all tasks, by the mean of their ranks."""
    ahead_on: int = 0
    """Tasks on which the best change must earn more than the present settings; otherwise these stay (`pooled` around
    the present settings only)."""

    def __post_init__(self) -> None:
        if self.rungs < 1 or self.eta < 2:
            raise ValueError(f"tuning needs at least 1 rung and eta 2, not {self.rungs} and {self.eta}")
        if not 0.0 < self.share <= 1.0 or not 0.0 < (1.0 if self.spread is None else self.spread) <= 1.0:
            raise ValueError(f"share and spread must be above 0 and at most 1, not {self.share} and {self.spread}")
        if self.ahead_on and not (self.pooled and self.spread is not None):
            raise ValueError("ahead_on needs a pooled search around the present settings: pooled and spread")
        if self.sizes[-1] < 1:
            raise ValueError(f"{self.settings} settings are too few for {self.rungs} rungs with eta {self.eta}")
        if not self.seeds or not set(self.seeds) <= set(TUNING_SEEDS) or len(set(self.seeds)) < len(self.seeds):
            raise ValueError(f"seeds of tuning must be different ones from 0 to {TUNING_SEEDS[-1]}, not {self.seeds}")

    @property
    def sizes(self) -> list[int]:
        """Number of settings in each rung, for every method on every task."""
        return [self.settings // self.eta**rung for rung in range(self.rungs)]

    def budgets(self, steps: int) -> list[int]:
        """Return the budget of a cell in each rung, in environment steps, where the profile's budget is `steps`."""
        return [max(1, round(self.share * steps / self.eta ** (self.rungs - 1 - rung))) for rung in range(self.rungs)]

    def steps(self, budgets: Sequence[int]) -> int:
        """Return the environment steps of the whole search for one method on one task, from the budgets of rungs."""
        return len(self.seeds) * sum(size * budget for size, budget in zip(self.sizes, budgets, strict=True))
