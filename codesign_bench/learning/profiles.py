"""What the profiles set for every PPO-based method: the paper's optimiser settings, and ours for a laptop.

The paper uses the same optimiser settings for its own method, the shared architecture and HWasP-minimal.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from codesign_bench.studies.corl2023.learners import LEARNERS, MlpBaselineTable

Sourced = Mapping[str, tuple[Any, str]]
"""Values of hyperparameters with their sources."""

Tuned = Mapping[str, Mapping[str, Any]]
"""Profile ("laptop", "quick") -> what it sets; `quick` adds to `laptop`."""

TUNED: Tuned = {
    "laptop": {"gamma": 0.98, "final_learning_rate_fraction": 0.2},
    "quick": {"final_learning_rate_fraction": 1.0},
}
"""Differences from the defaults, on every task (ours)."""

TASK_TUNED: Mapping[str, Mapping[str, Any]] = {
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
"""What `laptop` and `quick` set otherwise for a task, the same for every PPO-based method (ours)."""


def sourced(values: Mapping[str, Any], source: str) -> dict[str, tuple[Any, str]]:
    """Give every value the same source."""
    return {key: (value, source) for key, value in values.items()}


def ppo_profile(profile: str, task_name: str) -> dict[str, tuple[Any, str]]:
    """Return the optimiser settings of a profile for a task, each with its source.

    A task that the paper does not have gets the settings of the paper's push in the profile `paper`.
    """
    if profile == "paper":
        return paper_optimizer(task_name)
    return tuned(profile, TUNED) | sourced(TASK_TUNED.get(task_name, {}), f"tuned for {task_name} (ours)")


def tuned(profile: str, table: Tuned) -> dict[str, tuple[Any, str]]:
    """Return what `table` sets in one of our own profiles; nothing for the profile `paper`."""
    names = {"paper": (), "laptop": ("laptop",), "quick": ("laptop", "quick")}[profile]
    return {key: entry for name in names for key, entry in sourced(table[name], f"{name} profile (ours)").items()}


def paper_source(task_name: str) -> str:
    """Return how values from the task's table are cited."""
    return f"paper, table of {task_name}" if task_name in LEARNERS else "paper, table of push (no table for this task)"


def paper_optimizer(task_name: str) -> dict[str, tuple[Any, str]]:
    """Return the optimiser rows of the paper's table for the task, and what the paper's method implies."""
    table = LEARNERS.get(task_name, LEARNERS["push"])
    rows = {
        "batch_size": table.batch_size,
        "minibatch_size": table.minibatch_size,
        "epochs": table.epochs,
        "policy_learning_rate": table.policy_learning_rate,
        "value_learning_rate": table.value_learning_rate,
        "entropy_weight": table.entropy_weight,
        "kl_threshold": table.kl_threshold,
        "control_log_std": table.control_log_std,
        "design_log_std": table.design_log_std,
        "fix_std": table.fix_std,
    }
    method = {"design_credit": "joint"}
    base = {"normalize_returns": False, "final_learning_rate_fraction": 1.0}
    return (
        sourced(rows, paper_source(task_name))
        | sourced(method, "paper, section 'Policy learning': both phases train jointly")
        | sourced(base, "Transform2Act's default; the paper is silent")
    )


def paper_graph_networks(task_name: str) -> dict[str, tuple[Any, str]]:
    """Return the network rows of the paper's table for the task."""
    table = LEARNERS.get(task_name, LEARNERS["push"])
    rows = {
        "control_gnn": table.control_gnn,
        "control_index_mlp": table.control_index_mlp,
        "design_gnn": table.design_gnn,
        "design_index_mlp": table.design_index_mlp,
    }
    value = sourced({"value_mlp": (512, 256)}, "Transform2Act's default; the paper is silent")
    return sourced(rows, paper_source(task_name)) | value


def paper_perceptrons(table: MlpBaselineTable, task_name: str) -> dict[str, tuple[Any, str]]:
    """Return the rows of a baseline of the paper that learns perceptrons by PPO."""
    rows = {
        "policy_net": table.policy_net,
        "value_net": table.value_net,
        "policy_learning_rate": table.learning_rate,
        "value_learning_rate": table.learning_rate,
        "batch_size": table.batch_size_for(task_name),
        "minibatch_size": table.minibatch_size,
    }
    return sourced(rows, "paper, table of baseline hyperparameters")
