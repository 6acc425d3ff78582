"""The workload of a speed measurement: batch, task and networks; and its result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from codesign_bench.config.resolve import resolve
from codesign_bench.method import load_method, method_names, usable_methods
from codesign_bench.study import DEFAULT_STUDY, load_study
from codesign_bench.task import task_names


def study_profile() -> str:
    """Return the profile of the default study, with the networks of its publication."""
    return load_study(DEFAULT_STUDY).profiles[0].name


@dataclass(frozen=True)
class Workload:
    """The workload of every contestant."""

    task: str = field(default_factory=lambda: task_names()[0])
    profile: str = field(default_factory=study_profile)
    """Profile of the networks of all contestants."""
    batch_size: int = 50_000
    minibatch_size: int = 2_000
    epochs: int = 10
    cores: int = 1
    cells: int = 1
    """Number of parallel processes with the same work, each on `cores` cores, as in a sweep."""
    repeats: int = 3
    environments: int = 50
    """Number of environments of stable-baselines3; ours follows from the batch."""


@dataclass(frozen=True)
class Speed:
    """The speed of one contestant, as medians over the repeats."""

    rollout: float
    """Environment steps per second of rollouts, including the policy."""
    update: float
    """Samples per second of the update, forward and backward, policy and value."""
    peak_megabytes: float
    gigaflops: float | None = None
    """Useful floating-point operations per second of the update, in 1e9; None: not counted."""
    how: str = ""

    def end_to_end(self, epochs: int) -> float:
        """Return environment steps per second of rollout and update together."""
        return 1.0 / (1.0 / self.rollout + epochs / self.update)


def configured(setting: str, work: Workload) -> Any:
    """Return a setting of the networks for the work's task and profile, from the first method that has it.

    Raises:
        LookupError: no method has it.
    """
    for name in usable_methods(method_names()):
        config = resolve(load_method(name), work.task, work.profile).method
        if hasattr(config, setting):
            return getattr(config, setting)
    raise LookupError(f"no method has a setting '{setting}'")


def together(speeds: Sequence[Speed]) -> Speed:
    """Return the total speed of parallel cells; the memory is that of the largest cell."""
    counted = [speed.gigaflops for speed in speeds if speed.gigaflops is not None]
    return Speed(
        rollout=sum(speed.rollout for speed in speeds),
        update=sum(speed.update for speed in speeds),
        peak_megabytes=max(speed.peak_megabytes for speed in speeds),
        gigaflops=sum(counted) if counted else None,
        how=speeds[0].how,
    )
