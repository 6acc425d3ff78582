"""The run settings: what the runner owns, whatever the method, and what each profile makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from codesign_bench.errors import UserError, unknown_name

DEFAULT_PROFILE = "laptop"
DEVICES = ("cpu", "cuda")
PRECISIONS = ("fp32", "auto")


@dataclass(frozen=True)
class RunSettings:
    """What a cell is run with besides its method's hyperparameters; the values here hold where a profile is silent."""

    steps: int = 1_000_000
    """Budget in environment steps, design steps and every candidate's included."""
    evaluations: int = 25
    """Evaluations after the first, which judges the untrained policy."""
    fine_tuning_steps: int = 100_000
    """Budget of cells that go on with one instance (--finetune, --scratch)."""
    tradeoff_scale: float = 1.0
    """K of equation 1; used with --alpha alone, the paper has K = 0 elsewhere."""
    threads: int = 1
    """Cores of one cell: rollouts in processes, updates of policy and value in threads; no number depends on it."""
    device: str = "cpu"
    """Where networks are updated: cpu or cuda. Rollouts are on the processor always; sums of floats depend on it."""

    def __post_init__(self) -> None:
        if self.device not in DEVICES:
            raise ValueError(f"device is one of {', '.join(DEVICES)}, not '{self.device}'")
        for name in ("steps", "evaluations", "fine_tuning_steps", "threads"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if self.tradeoff_scale < 0.0:
            raise ValueError(f"tradeoff_scale must not be negative: {self.tradeoff_scale}")


Settings = Mapping[str, tuple[Any, str]]

PROFILES: Mapping[str, Settings] = {
    "quick": {"steps": (180_000, "ours"), "evaluations": (9, "ours")},
    "laptop": {"steps": (1_000_000, "ours"), "evaluations": (20, "ours")},
    "paper": {"steps": (10_000_000, "paper, learning curves"), "evaluations": (100, "ours")},
}
"""What each profile sets, with its source, in the order of growing cost."""

PROFILE_HELP: Mapping[str, str] = {
    "quick": "minutes on two cores: the same code, for a first look",
    "laptop": "an hour or two per 2D task on two cores (default)",
    "paper": "the paper's hyperparameter tables and 10 million steps",
}

TASK_SETTINGS: Mapping[tuple[str, str], Settings] = {
    ("quick", "scoop"): {"steps": (260_000, "tuned for scoop (ours)")},
    ("laptop", "scoop"): {"steps": (600_000, "tuned for scoop (ours)")},
    ("laptop", "catch_balls"): {"tradeoff_scale": (0.01, "tuned for catch_balls (ours)")},
    ("quick", "catch_balls"): {
        "steps": (400_000, "tuned for catch_balls (ours)"),
        "tradeoff_scale": (0.01, "tuned for catch_balls (ours)"),
    },
    ("laptop", "lift_cup"): {"steps": (700_000, "tuned for lift_cup (ours)")},
    ("quick", "lift_cup"): {"steps": (400_000, "tuned for lift_cup (ours)")},
    ("laptop", "scoop_3d"): {
        "steps": (500_000, "tuned for scoop_3d (ours)"),
        "evaluations": (10, "tuned for scoop_3d (ours)"),
    },
}
"""What a (profile, task) pair sets otherwise than its profile; third-party tasks run with the profile's values."""


def run_profile(profile: str, task_name: str) -> Settings:
    """Return the run settings that `profile` makes for a task: key -> (value, source).

    Raises:
        UserError: there is no such profile.
    """
    if profile not in PROFILES:
        raise unknown_name("profile", profile, PROFILES)
    return {**PROFILES[profile], **TASK_SETTINGS.get((profile, task_name), {})}


def check_fractions(cutouts: list[float], alphas: list[float]) -> None:
    """Refuse cutout fractions outside (0, 1) and trade-off coefficients outside [0, 1].

    Raises:
        UserError: naming the first bad one.
    """
    for fraction in cutouts:
        if not 0.0 < fraction < 1.0:
            raise UserError(f"--cutout: {fraction:g} is no fraction between 0 and 1 (both excluded)")
    for alpha in alphas:
        if not 0.0 <= alpha <= 1.0:
            raise UserError(f"--alpha: {alpha:g} does not lie in 0 to 1")
