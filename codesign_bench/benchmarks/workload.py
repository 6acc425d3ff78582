"""What is measured of a learner, on what work, and with which networks."""

from __future__ import annotations

import re
import resource
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from codesign_bench.config.resolve import resolve
from codesign_bench.method import load_method, method_names
from codesign_bench.study import DEFAULT_STUDY, load_study
from codesign_bench.task import task_names


def study_profile() -> str:
    """Return the profile that the default study brings: its publication's networks."""
    return load_study(DEFAULT_STUDY).profiles[0].name


@dataclass(frozen=True)
class Workload:
    """What every contestant does."""

    task: str = field(default_factory=lambda: task_names()[0])
    profile: str = field(default_factory=study_profile)
    """Whose networks everyone has."""
    batch_size: int = 50_000
    minibatch_size: int = 2_000
    epochs: int = 10
    cores: int = 1
    cells: int = 1
    """Processes that do the same at once, each on `cores` cores: the sweep's case."""
    repeats: int = 3
    environments: int = 50
    """Of stable-baselines3; ours follow from the batch."""


@dataclass(frozen=True)
class Speed:
    """What one contestant reached, as medians over the repeats."""

    rollout: float
    """Environment steps per second of rollouts, the policy in the loop."""
    update: float
    """Samples per second that pass through the update, forward and backward, policy and value."""
    peak_megabytes: float
    gigaflops: float | None = None
    """Useful floating-point operations per second of the update, 1e9; None: not counted."""
    how: str = ""

    def end_to_end(self, epochs: int) -> float:
        """Return environment steps per second of rollout and update together."""
        return 1.0 / (1.0 / self.rollout + epochs / self.update)


def configured(setting: str, work: Workload) -> Any:
    """Return a setting of the networks, as the first method that has it gets it for the work's task and profile.

    Raises:
        LookupError: no method has it.
    """
    for name in method_names():
        config = resolve(load_method(name), work.task, work.profile).method
        if hasattr(config, setting):
            return getattr(config, setting)
    raise LookupError(f"no method has a setting '{setting}'")


def peak_megabytes() -> float:
    """Return the most memory that this process and the largest of its ended children ever held.

    The kernel's maximum in `getrusage` outlives `exec`: it may be that of the process that started this one. Where
    /proc tells of this program alone, that is taken.
    """
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    status = Path("/proc/self/status")
    if status.exists():
        own = int(re.search(r"^VmHWM:\s+(\d+) kB", status.read_text(), re.MULTILINE)[1])  # type: ignore[index]
    return (own + resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) / 1024.0


def together(speeds: Sequence[Speed]) -> Speed:
    """Return what cells that ran side by side reached in all; the memory is the largest cell's."""
    counted = [speed.gigaflops for speed in speeds if speed.gigaflops is not None]
    return Speed(
        rollout=sum(speed.rollout for speed in speeds),
        update=sum(speed.update for speed in speeds),
        peak_megabytes=max(speed.peak_megabytes for speed in speeds),
        gigaflops=sum(counted) if counted else None,
        how=speeds[0].how,
    )
