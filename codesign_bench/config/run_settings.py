"""The run settings: what the runner owns, whatever the method."""

from __future__ import annotations

from dataclasses import dataclass

DEVICES = ("cpu", "cuda")
PRECISIONS = ("fp32", "auto")


@dataclass(frozen=True)
class RunSettings:
    """What a cell is run with beside its method's hyperparameters; these values hold where a profile sets nothing."""

    steps: int = 1_000_000
    """Budget in environment steps; design steps and the steps of every candidate count."""
    evaluations: int = 25
    """Evaluations after the first, which judges the untrained policy."""
    fine_tuning_steps: int = 100_000
    """Budget of cells that train on one instance alone (--finetune, --scratch)."""
    tradeoff_scale: float = 1.0
    """K of equation 1; used with --alpha alone, the paper has K = 0 elsewhere."""
    threads: int = 1
    """Cores of one cell: rollouts in processes, updates of policy and value in threads; no result depends on it."""
    device: str = "cpu"
    """Where networks are updated: cpu or cuda. Rollouts always run on the processor; sums of floats depend on it."""

    def __post_init__(self) -> None:
        if self.device not in DEVICES:
            raise ValueError(f"device is one of {', '.join(DEVICES)}, not '{self.device}'")
        for name in ("steps", "evaluations", "fine_tuning_steps", "threads"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if self.tradeoff_scale < 0.0:
            raise ValueError(f"tradeoff_scale must not be negative: {self.tradeoff_scale}")
