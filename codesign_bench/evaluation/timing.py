"""Training times of methods, from the cells' records, and inference times of their policies, measured now.

Shapes: `O` observation.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from codesign_bench.cell.variant import DEFAULT
from codesign_bench.console import Log, silent
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import StoredCell, reported_cells
from codesign_bench.storage.layout import first_run
from codesign_bench.storage.policies import misfit, policy_of
from codesign_bench.task import load_task, task_names, usable_tasks
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import designed

if TYPE_CHECKING:
    import pandas as pd

CALLS = 200
"""Number of timed calls of a policy, with one observation each."""


def timing_frame(results: Path, log: Log = silent) -> pd.DataFrame:
    """Return one row per finished cell of the default variant below `results`.

    Columns: task, method, label, seed, profile, env_steps, train_s (without evaluation), cores (of the
    cell), cpu, inference_s (median time of one control step's policy call; one seed per task and method is timed, NaN
    elsewhere and where there is no policy that fits the task's observation). `log` names tasks that cannot be played in
    this Python.

    Raises:
        UserError: there is no such cell.
    """
    import pandas as pd

    rows = []
    present = {cell.record.task for cell in reported_cells(results)}
    playable = usable_tasks([name for name in task_names() if name in present], log)
    timed: set[tuple[str, str]] = set()
    for cell in reported_cells(results):
        record = cell.record
        if not cell.is_done or record.variant != DEFAULT:
            continue
        pair = (record.task, record.method)
        is_timed = record.task in playable and pair not in timed and _fits(cell)
        if is_timed:
            timed.add(pair)
        rows.append(
            {
                "task": record.task,
                "method": record.method,
                "label": record.label,
                "seed": record.seed,
                "profile": record.profile,
                "env_steps": record.env_steps,
                "train_s": math.nan if record.timings.train_s is None else record.timings.train_s,
                "cores": record.threads,
                "cpu": str(record.host.get("cpu")),
                "inference_s": inference_seconds(cell) if is_timed else float("nan"),
            }
        )
    if not rows:
        raise UserError(f"no finished cell in '{results}' yet; create some with: {first_run(results)}")
    return pd.DataFrame(rows)


def _fits(cell: StoredCell) -> bool:
    """Return whether a cell has a policy that can act on its task."""
    try:
        return cell.has_policy and not misfit(cell)
    except UserError:  # damaged, or of a task or method that is not here
        return False


def inference_seconds(cell: StoredCell) -> float:
    """Return the median time of one call of the cell's policy in the control phase with one observation, s."""
    task, policy = load_task(cell.record.task), policy_of(cell)
    episodes = Episodes(task, 1)
    designed(episodes, policy, task.evaluation_instances()[:1])
    observation = episodes.observation[0].copy()
    seconds = []
    for _ in range(CALLS):
        started = time.perf_counter()
        policy.act(observation)
        seconds.append(time.perf_counter() - started)
    return median(seconds)
