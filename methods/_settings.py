"""Settings of our own profiles for every PPO-based method, found by hand on tuning seeds (ours)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from codesign_bench.config.settings import Settings, sourced

Tuned = Mapping[str, Mapping[str, Any]]
"""Part of a profile ("laptop", "quick") -> its settings."""

LAYERS = {"laptop": ("laptop",), "workstation": ("laptop",), "quick": ("laptop", "quick")}
"""Profile -> the parts of a `Tuned` table that it consists of; later ones override. Other profiles have none."""

PPO: Tuned = {
    "laptop": {"gamma": 0.98, "final_learning_rate_fraction": 0.2},
    "quick": {"final_learning_rate_fraction": 1.0},
}
"""Differences from the defaults, on every task."""

PPO_BY_TASK: Mapping[str, Mapping[str, Any]] = {
    "bounce": {"gamma": 0.99, "design_log_std": -1.5},
    "gather": {"gamma": 0.99},
    "catch_balls": {"design_log_std": -0.3},
    "lift_cup": {
        "batch_size": 20_000,
        "minibatch_size": 2_000,
        "epochs": 5,
        "gamma": 0.99,
        "control_log_std": -1.5,
    },
    "fetch_cube": {"gamma": 0.99},
    "scoop": {"control_log_std": -1.0},
    "scoop_3d": {"gamma": 0.99, "control_log_std": -1.5},
}
"""Settings of our own profiles that differ for a task, the same for every PPO-based method."""

SMALL_PPO = {"batch_size": 600, "minibatch_size": 150, "epochs": 2, "design_epochs": 2, "design_minibatch_size": 2}
SMALL_GRAPHS = {
    "control_gnn": (16, 16),
    "control_index_mlp": (16,),
    "design_gnn": (16, 16),
    "design_index_mlp": (16,),
    "value_mlp": (16,),
}
SMALL_PERCEPTRONS = {"policy_net": (16, 16), "value_net": (16, 16)}
"""Parts of `Method.small`."""


def tuned(profile: str, table: Tuned) -> Settings:
    """Return the settings of `table` for one of our own profiles; none for any other."""
    layers = LAYERS.get(profile, ())
    return {key: entry for name in layers for key, entry in sourced(table[name], f"{name} profile (ours)").items()}


def ppo_settings(profile: str, task_name: str) -> Settings:
    """Return the optimiser settings of one of our own profiles for a task; none for any other profile."""
    return {**tuned(profile, PPO), **tuned_for(profile, task_name, PPO_BY_TASK)}


def tuned_for(
    profile: str, task_name: str, table: Mapping[str, Mapping[str, Any]], profiles: Collection[str] = tuple(LAYERS)
) -> Settings:
    """Return the settings of `table` for a task in those of our own profiles for which they were found; else none."""
    found = table.get(task_name, {}) if profile in profiles else {}
    return sourced(found, f"tuned for {task_name} (ours)")
