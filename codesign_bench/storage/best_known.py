"""The best episode that is known of every evaluation instance, beside the cells.

OUT/best_known/<task>.csv           one row per episode, with the form `BEST_KNOWN_EPISODES`
OUT/best_known/<task>.safetensors   their plans, by the names in the column `plan`

An instance has the episode with the highest return and, if this one does not solve it, the best that does. Entries
give way to better ones alone, also if several processes write at once.

Shapes: `X` numbers of a plan: a design and a control for every step.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import filelock
import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.method import Array
from codesign_bench.storage.arrays import load_arrays, save_arrays
from codesign_bench.storage.files import saying_why
from codesign_bench.storage.layout import open_folder
from codesign_bench.storage.locks import locked
from codesign_bench.storage.measurements import BEST_KNOWN_EPISODES, PLANS_SUFFIX
from codesign_bench.storage.reading import DamagedFile
from codesign_bench.storage.tables import read_table, write_table
from codesign_bench.task import Singles, Task
from codesign_bench.task.plans import designs_of, plan_size

LOCK_SECONDS = 60.0
"""Longest wait for another process that is writing a table."""


@dataclass(frozen=True)
class Episode:
    """One episode of an evaluation instance, with all that it takes to repeat it."""

    instance: int
    earned: float
    """The return."""
    solved: bool
    length: int
    """Control steps."""
    source: str
    """Who found it: a cell, a script, a search, in words."""
    plan: Singles
    """(X,) in [-1, 1]."""

    @property
    def name(self) -> str:
        """The name of its plan, which tells it from others."""
        return f"plan-{hashlib.sha256(self.plan.tobytes()).hexdigest()[:16]}"

    def adds_to(self, others: Iterable[Episode]) -> bool:
        """Return whether none of the others is at least as good in return and in success."""
        return not any(other.earned >= self.earned and other.solved >= self.solved for other in others)


@dataclass
class BestKnown:
    """The best episodes of a task, and how much they were searched for."""

    episodes: dict[int, list[Episode]] = field(default_factory=dict)
    """Instance -> one or two, the highest return first."""
    searched: dict[int, int] = field(default_factory=dict)
    """Instance -> episodes that searches have spent on it."""

    def offer(self, episode: Episode) -> bool:
        """Take over an episode if it is better than what is known; return whether it is."""
        known = self.episodes.get(episode.instance, [])
        if not episode.adds_to(known):
            return False
        left = [other for other in known if other.adds_to([episode])]
        self.episodes[episode.instance] = sorted([*left, episode], key=lambda one: -one.earned)
        return True

    def best(self, instance: int) -> Episode | None:
        """Return the episode with the highest return, or None if none is known."""
        return next(iter(self.episodes.get(instance, [])), None)

    def merge(self, other: BestKnown) -> None:
        """Take over what is better in another, and the larger count of searched episodes."""
        for episodes in other.episodes.values():
            for episode in episodes:
                self.offer(episode)
        for instance, count in other.searched.items():
            self.searched[instance] = max(count, self.searched.get(instance, 0))


def path_of(results: Path, task_name: str) -> Path:
    """Return the path of the table of a task below `results`."""
    return results / BEST_KNOWN_EPISODES.pattern.replace("*", task_name)


def load_best_known(results: Path, task: Task) -> BestKnown:
    """Return what is known of this version of a task; nothing if there is no table.

    Raises:
        UnusableFile: a file cannot be used.
    """
    path = path_of(results, task.name)
    table = read_table(path, BEST_KNOWN_EPISODES.form)
    if table is None or set(table["task_version"]) != {task.version}:
        return BestKnown()
    plans = _plans(path.with_suffix(PLANS_SUFFIX))
    size, count = plan_size(task), task.num_evaluation_instances
    known = BestKnown()
    for row in table.to_dict("records"):
        plan = plans.get(row["plan"])
        if plan is None or plan.shape != (size,) or not np.isfinite(plan).all() or row["instance"] >= count:
            raise DamagedFile(path, f"there is no {row['plan']} of this task for instance {row['instance']}")
        instance = int(row["instance"])
        solved, length = bool(row["success"]), int(row["episode_length"])
        known.offer(Episode(instance, float(row["return"]), solved, length, str(row["source"]), plan))
        known.searched[instance] = int(row["searched"])
    return known


def store(results: Path, task: Task, known: BestKnown) -> None:
    """Write what is known of a task, merged with what another process has written since; `known` gets that, too.

    Raises:
        UserError: the folder is not writable, or a file in it cannot be used.
    """
    path = path_of(results, task.name)
    plans_path = path.with_suffix(PLANS_SUFFIX)
    open_folder(results)
    with saying_why(f"--results {results}", path):
        path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with locked(path.parent, LOCK_SECONDS):
            before = load_best_known(results, task)
            known.merge(before)
            plans = {episode.name: episode.plan for episode in _episodes(known)}
            former = {episode.name: episode.plan for episode in _episodes(before)}
            # The table never names a plan that is not there: new plans come before it, and former ones go after it.
            with saying_why(f"--results {results}", plans_path):
                save_arrays(plans_path, {**former, **plans}, _header(task))
            write_table(results, path, _table(task, known))
            if set(former) - set(plans):
                with saying_why(f"--results {results}", plans_path):
                    save_arrays(plans_path, plans, _header(task))
    except filelock.Timeout:
        raise UserError(f"--results {results}: another process holds the lock of {path.parent}") from None


def _episodes(known: BestKnown) -> list[Episode]:
    return [episode for _, episodes in sorted(known.episodes.items()) for episode in episodes]


def _table(task: Task, known: BestKnown) -> Any:
    """Return a frame with one row per episode."""
    import pandas as pd

    instances, rows = task.evaluation_instances(), []
    for episode in _episodes(known):
        design = task.design_space.from_unit(np.clip(designs_of(task, episode.plan), -1.0, 1.0))
        named = (
            ("instance", task.instance_space.names, instances[episode.instance]),
            ("design", task.design_space.names, design),
        )
        rows.append(
            {
                "task": task.name,
                "task_version": task.version,
                "instance": episode.instance,
                "return": episode.earned,
                "success": int(episode.solved),
                "episode_length": episode.length,
                "source": episode.source,
                "searched": known.searched.get(episode.instance, 0),
                "plan": episode.name,
                **{
                    f"{kind}_{name}": float(value)
                    for kind, names, values in named
                    for name, value in zip(names, values, strict=True)
                },
            }
        )
    return pd.DataFrame(rows)


def _header(task: Task) -> Mapping[str, Any]:
    return {"task": task.name, "task_version": task.version}


def _plans(path: Path) -> dict[str, Array]:
    """Return the plans in a file.

    Raises:
        UnusableFile: it is missing or cannot be used.
    """
    try:
        return load_arrays(path)[0]
    except FileNotFoundError:
        raise DamagedFile(path, "it is missing, although the table beside it is there") from None
    except ValueError as error:
        raise DamagedFile(path, str(error)) from error
