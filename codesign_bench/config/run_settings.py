"""The run settings: settings of the runner, the same for all methods."""

from __future__ import annotations

from dataclasses import dataclass

DEVICES = ("cpu", "cuda")
PRECISIONS = ("fp32", "auto")
EVALUATION, VALIDATION = "evaluation", "validation"
"""Names of a task's two fixed sets of instances: for results that are reported, and for choosing settings."""


@dataclass(frozen=True)
class RunSettings:
    """Settings of a cell other than its method's hyperparameters, with defaults that a profile may override."""

    steps: int = 1_000_000
    """Budget in environment steps, including design steps and the steps of every candidate."""
    evaluations: int = 25
    """Number of evaluations, not counting the first, which evaluates the untrained policy."""
    fine_tuning_steps: int = 100_000
    """Budget of cells that train at a single place (--finetune, --scratch)."""
    fine_tuning_instances: int = 1
    """Instances at that place, on which such a cell trains and is evaluated; the axes set it."""
    tradeoff_scale: float = 1.0
    """K of equation 1; used only with --alpha, since the paper has K = 0 elsewhere."""
    threads: int = 1
    """Cores of one cell: rollouts in processes, updates of policy and value in threads; results do not depend on it."""
    device: str = "cpu"
    """Device of network updates: cpu or cuda. Rollouts always run on the CPU. Floating-point results depend on it."""

    instances: str = EVALUATION
    """Instances of evaluations: evaluation, or validation for tuning. Results on the latter are never reported."""

    def __post_init__(self) -> None:
        if self.device not in DEVICES:
            raise ValueError(f"device must be one of {', '.join(DEVICES)}, not '{self.device}'")
        if self.instances not in (EVALUATION, VALIDATION):
            raise ValueError(f"instances must be {EVALUATION} or {VALIDATION}, not '{self.instances}'")
        for name in ("steps", "evaluations", "fine_tuning_steps", "fine_tuning_instances", "threads"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if self.tradeoff_scale < 0.0:
            raise ValueError(f"tradeoff_scale must not be negative: {self.tradeoff_scale}")
