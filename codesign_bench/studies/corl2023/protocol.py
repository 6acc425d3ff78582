"""Protocol and running times of the paper's experiments."""

from __future__ import annotations

from dataclasses import dataclass

from codesign_bench.studies.corl2023.ranges import Interval


@dataclass(frozen=True)
class Timing:
    """Time that one method took on fetch cube, on an NVIDIA Titan RTX and an Intel Xeon Gold 5220."""

    training_minutes: float
    """Wall clock for 10^7 environment steps."""
    inference_seconds: float | None
    """One forward pass; None if there is no model."""


@dataclass(frozen=True)
class Patch:
    """A rectangle of fetch cube's starts, in m."""

    x: Interval
    y: Interval


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """Protocol of the paper's experiments (captions and appendix "Experimental Details")."""

    total_steps: int
    """Environment steps of one training run, from the paper's timing table."""
    seeds: int
    """Seeds per method and task in the learning curves."""
    seeds_scoop_3d: int
    """The same on scoop 3D."""
    seeds_generalisation: int
    """Seeds of the cutout and fine-tuning experiments."""
    cutout_fractions: tuple[float, ...]
    """Fractions of the training area that were cut out."""
    fetch_cube_region: Patch
    """Fetch cube's training region."""
    fetch_cube_patches: tuple[Patch, Patch]
    """The two patches of its cutout region, which the fractions scale."""
    fine_tuning_starts: tuple[Interval, Interval, Interval, Interval]
    """Starts (x, y) outside the training region, in m."""
    alphas: tuple[float, ...]
    """Trade-off parameters trained on catch balls (equation 1)."""

    def seeds_for(self, task_name: str) -> int:
        """Return the number of seeds in the learning curves of the task `task_name`."""
        return self.seeds_scoop_3d if task_name == "scoop_3d" else self.seeds


# The unlabelled table of section "Computational Resources"
TIMINGS: dict[str, Timing] = {
    "gnn_ppo": Timing(2.12e2, 1.68e-3),
    "shared_arch": Timing(7.29e2, 5.24e-4),
    "cma_rl": Timing(1.18e3, 5.32e-4),
    "hwasp_minimal": Timing(2.98e2, 1.75e-3),
    "cma_es": Timing(3.46e2, None),
}


# Captions of fig:sample_efficiency and fig:interpolation; sections "Computational Resources", "Generalization to
# Unseen Goals Experiment Details" and "Trading off Design and Control Complexity Experiment Details"
PROTOCOL = Protocol(
    total_steps=10_000_000,
    seeds=6,
    seeds_scoop_3d=3,
    seeds_generalisation=3,
    cutout_fractions=(0.1, 0.2, 0.4, 0.6, 0.8, 0.9),
    fetch_cube_region=Patch(x=(-0.395, 0.395), y=(0.4, 0.7)),
    fetch_cube_patches=(
        Patch(x=(-0.350, -0.045), y=(0.434, 0.666)),
        Patch(x=(0.045, 0.350), y=(0.434, 0.666)),
    ),
    fine_tuning_starts=((-0.167, 0.367), (-0.129, 0.357), (0.430, 0.493), (0.415, 0.610)),
    alphas=(0.0, 0.3, 0.7, 1.0),
)
