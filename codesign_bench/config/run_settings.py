"""The run settings: settings of the runner, the same for all methods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Within

Device: TypeAlias = Literal["cpu", "cuda"]
PrecisionChoice: TypeAlias = Literal["fp32", "auto"]
EVALUATION, VALIDATION = "evaluation", "validation"
"""Names of a task's two fixed sets of instances: for results that are reported, and for choosing settings."""
Instances: TypeAlias = Literal["evaluation", "validation"]
OVERSHOOT = 0.02
"""Share of a budget by which the last batch may exceed it, since its episodes are finished. It is as long as the
longest batch of the profile `laptop` may exceed the one wanted, so batches of usual budgets are not cut."""
Steps: TypeAlias = Annotated[int, Within(1, 1_000_000_000_000)]
Threads: TypeAlias = Annotated[int, Within(1, 4_096)]


@dataclass(frozen=True)
class RunSettings:
    """Settings of a cell other than its method's hyperparameters, with defaults that a profile may override."""

    steps: Steps = 1_000_000
    """Budget in environment steps, including design steps and the steps of every candidate."""
    evaluations: Annotated[int, Within(1, 100_000)] = 25
    """Number of evaluations, not counting the first, which evaluates the untrained policy."""
    fine_tuning_steps: Steps = 100_000
    """Budget of cells that train at a single place (--finetune, --scratch)."""
    fine_tuning_instances: Annotated[int, Within(1, 10_000)] = 1
    """Instances at that place, on which such a cell trains and is evaluated; the axes set it."""
    tradeoff_scale: Annotated[float, Within(0.0, 1e6)] = 1.0
    """K of equation 1; used only with --alpha, since the paper has K = 0 elsewhere."""
    threads: Threads = 1
    """Cores of one cell: rollouts in processes, updates of policy and value in threads; results do not depend on it."""
    device: Device = "cpu"
    """Device of network updates: cpu or cuda. Rollouts always run on the CPU. Floating-point results depend on it."""

    instances: Instances = "evaluation"
    """Instances of evaluations: evaluation, or validation for tuning. Results on the latter are never reported."""

    def __post_init__(self) -> None:
        check_values(self)
