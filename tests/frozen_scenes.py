"""What every task does in its first steps, as pinned in `data/frozen_scenes.json`: `python tests/frozen_scenes.py`.

A scene is frozen under its version. A change that moves these numbers changes what results mean: raise the task's
`version` first, then run this file. It leaves pinned numbers of a version as they are and adds those that are new.
"""

from __future__ import annotations

import json
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from codesign_bench.registry import presented
from codesign_bench.task import Task, load_task
from codesign_bench.task.behaviours import RandomBehaviour
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import play

FILE = Path(__file__).parent / "data" / "frozen_scenes.json"
INSTANCES = 4
STEPS = (0, 1, 5, 12)
"""Control steps after which the observations are pinned: further on, contact makes more of what processors round."""


def course(task: Task) -> dict[str, Any]:
    """Return observations of a few evaluation instances along random episodes, and the rewards of these steps."""
    episodes = Episodes(task, INSTANCES)
    behaviour = RandomBehaviour(task, np.random.default_rng(0))
    seen, rewards = [], []
    for turn in islice(play(episodes, behaviour, task.evaluation_instances()[:INSTANCES]), max(STEPS) + 1):
        rewards.append(float(turn.reward.sum()))
        if turn.step in STEPS:
            seen.append(episodes.observation[:INSTANCES].astype(float).round(6).tolist())
    return {"observations": seen, "rewards": rewards}


def pinned() -> dict[str, dict[str, Any]]:
    """Return task -> version -> course, as the file has it."""
    courses: dict[str, dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    return courses


def main() -> None:
    """Add the courses of versions that are not pinned yet."""
    courses = pinned()
    for name in presented("tasks"):
        task = load_task(name)
        courses.setdefault(name, {}).setdefault(str(task.version), course(task))
    FILE.write_text(json.dumps(courses) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
