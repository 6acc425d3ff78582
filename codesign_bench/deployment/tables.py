"""Trials of deployed tools on disk: OUT/deployment/<task>/<kind>.csv, its summary and a GIF of each trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codesign_bench.deployment.rollout import Rollout
from codesign_bench.errors import UserError
from codesign_bench.storage.measurements import DEPLOYMENT, usable_tables
from codesign_bench.task import Floats, Task
from codesign_bench.task.robot import ArmReport, RobotTrials

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "deployment"
TRIALS_FILE = "trials.csv"
"""The table of trials chosen by a user; those of the paper's full protocol are one per policy."""
SEED, SOLVED_IN_TRAINING = "policy_seed", "solved_in_training"
"""Columns: the seed of the policy, and whether it solves the tool's own instance with the gantry of training."""
SUMMARY_SUFFIX = ".json"
PICTURES_FOLDER = "rollouts"
OWN, GRID = "own", "grid"
"""Kinds of trials: on the tool's own instance, or on a start of the grid."""
INCIDENTS = tuple(field.name for field in fields(ArmReport) if field.name.endswith("_steps"))
"""Counted events of the arm, in control steps."""


def row(task: Task, trials: RobotTrials, instance: Floats, rollout: Rollout, **where: Any) -> dict[str, Any]:
    """Return one table row: the trial (`where`), its instance (I,) by name, its result, and the arm's incidents."""
    missing = abs(rollout.outcome - trials.success_outcome)
    return {
        "task": task.name,
        **where,
        **{f"instance_{name}": float(value) for name, value in zip(task.instance_space.names, instance, strict=True)},
        "success": int(rollout.success),
        "near": int(not rollout.success and not rollout.failure and missing <= trials.near_miss),
        "lost": int(rollout.failure),
        "steps": rollout.steps,
        "outcome": round(rollout.outcome, 4),
        "friction_factor": round(rollout.physics.friction, 4),
        "mass_factor": round(rollout.physics.mass, 4),
        "tracking_error_mean_mm": round(1e3 * rollout.arm.tracking_error_mean, 3),
        "tracking_error_max_mm": round(1e3 * rollout.arm.tracking_error_max, 3),
        **{name: getattr(rollout.arm, name) for name in INCIDENTS},
    }


def protocol_file(policy_seed: int) -> str:
    """Return the name of the file with a policy's trials; that of seed 0 has the name of the first version."""
    return "protocol.csv" if policy_seed == 0 else f"protocol-seed-{policy_seed:02d}.csv"


def summarise(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return successes, incidents and tracking errors of each kind of trial and tool."""
    result = []
    for kind, tool in dict.fromkeys((entry["kind"], entry["tool"]) for entry in rows):
        own = [entry for entry in rows if (entry["kind"], entry["tool"]) == (kind, tool)]
        steps = sum(entry["steps"] for entry in own)
        error = sum(entry["steps"] * entry["tracking_error_mean_mm"] for entry in own) / max(steps, 1)
        result.append(
            {
                "kind": kind,
                "tool": tool,
                "trials": len(own),
                "successes": sum(entry["success"] for entry in own),
                "near": sum(entry["near"] for entry in own),
                "steps": steps,
                "tracking_error_mean_mm": round(error, 3),
                "tracking_error_max_mm": max(entry["tracking_error_max_mm"] for entry in own),
                **{name: sum(entry[name] for entry in own) for name in INCIDENTS},
            }
        )
    return result


def load_deployment(results: str | Path) -> pd.DataFrame:
    """Return the trials of the paper's protocol below `results`, one row each, for all tasks and policies.

    Trials of version 0.1.0 have no seed of the policy; it was 0.

    Raises:
        UserError: there are none.
    """
    import pandas as pd

    tables = usable_tables(Path(results), DEPLOYMENT)
    if not tables:
        raise UserError(
            f"no deployment in '{results}' yet; create one with: codesign-bench deploy --policy CELL --protocol "
            f"--out {results}"
        )
    trials = pd.concat(tables, ignore_index=True)
    seeds = trials[SEED] if SEED in trials.columns else pd.Series(0.0, index=trials.index)
    return trials.assign(**{SEED: seeds.fillna(0).astype(int)})
