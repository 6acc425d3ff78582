"""The tasks and methods of the paper, by this project's names."""

from __future__ import annotations

from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.studies.corl2023.scenes import SCENES

OURS = "gnn_ppo"
"""The paper's own method."""
SHARED = "shared_arch"
"""Its ablation."""
PRIOR = ("cma_rl", "hwasp_minimal", "cma_es")
"""Prior methods and baselines."""
METHODS = (OURS, SHARED, *PRIOR)
TASKS = tuple(SCENES)
SEEDS = {task: PROTOCOL.seeds_for(task) for task in TASKS}
"""Seeds of the learning curves on each task."""
SEEDS_FINE_TUNING = 8
"""Seeds of fine-tuning, where the paper has three: fewer cannot decide outcomes of 0 or 1 (ours)."""
SEEDS_ON_THE_ARM = 5
"""Policies on the arm, where the paper has one: as many as a claim about it needs (ours)."""
STARTS = tuple(range(1, 1 + len(PROTOCOL.fine_tuning_starts)))
"""Numbers of the starts of fetch cube outside the training region."""
