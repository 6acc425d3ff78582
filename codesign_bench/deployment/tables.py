"""Trials of deployed tools on disk: OUT/deployment/<task>/<kind>.csv, its summary and a GIF of each trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codesign_bench.deployment.rollout import Rollout
from codesign_bench.errors import UserError
from codesign_bench.task import Floats, Task
from codesign_bench.task.robot import ArmReport, RobotTrials

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "deployment"
PROTOCOL_FILE, TRIALS_FILE = "protocol.csv", "trials.csv"
"""Of the paper's whole protocol, and of trials that a user chose."""
SUMMARY_SUFFIX = ".json"
PICTURES_FOLDER = "rollouts"
OWN, GRID = "own", "grid"
"""Kinds of trials: on the instance that the tool was designed for, or on a start of the grid."""
INCIDENTS = tuple(field.name for field in fields(ArmReport) if field.name.endswith("_steps"))
"""What is counted of the arm, in control steps."""


def row(task: Task, trials: RobotTrials, instance: Floats, rollout: Rollout, **where: Any) -> dict[str, Any]:
    """Return one table row: which trial (`where`), its instance (I,) by name, how it went, and the arm's incidents."""
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
    """Return the trials of the paper's protocol below `results`, one row each, all tasks below each other.

    Raises:
        UserError: there are none.
    """
    import pandas as pd

    paths = sorted(Path(results).glob(f"{FOLDER}/*/{PROTOCOL_FILE}"))
    if not paths:
        raise UserError(
            f"no deployment in '{results}' yet; create one with: codesign-bench deploy --policy CELL --protocol "
            f"--out {results}"
        )
    return pd.concat([pd.read_csv(path) for path in paths], ignore_index=True)
