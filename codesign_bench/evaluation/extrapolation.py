"""Performance of trained policies on positions just outside the training region (paper, section 5.2).

The evaluation instances of a task are inside its region; these are around it, in a rim of `RIM` times its extent. The
tables are next to the cells, one per task, method and variant; every finished policy is played once.

Shapes: `N` instances, `I` instance, `B` batch, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.console import Log, silent
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.seeding import generator
from codesign_bench.storage.cells import StoredCell, reported_cells
from codesign_bench.storage.measurements import OUTSIDE_REGION, usable
from codesign_bench.storage.policies import policy_of
from codesign_bench.storage.tables import read_table, write_table
from codesign_bench.task import EVALUATION_SEED, Floats, Task, load_task
from codesign_bench.task.behaviours import Idle

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "outside_region"
RIM = 0.1
"""Largest distance of instances from the region, as a fraction of its extent along each axis (ours)."""
INSTANCES = 64
"""Number of instances drawn around the region (ours)."""
COLUMNS = ("task", "method", "seed", "instance", "return", "success")


def outside_instances(task: Task) -> Floats:
    """Return up to `INSTANCES` instances (N, I) around the training region, without those that an idle tool solves.

    Positions are drawn from around their ranges, all other entries from within their ranges.

    Raises:
        UserError: the task has no positions.
    """
    low, high = task.instance_space.bounds
    index = task.position_index
    room = np.zeros_like(low)
    room[index] = RIM * (high - low)[index]
    rng = generator(EVALUATION_SEED, f"outside the region of {task.name}")
    drawn = rng.uniform(low - room, high + room, size=(100 * INSTANCES, len(low)))
    beyond = ((drawn < low) | (drawn > high)).any(axis=1)
    instances = drawn[beyond][:INSTANCES]
    return instances[~evaluate(task, Idle(task), instances=instances).successes]


def load_or_measure(
    results: Path, pairs: Sequence[tuple[str, str]], log: Log, measure_missing: bool, variant: Variant = DEFAULT
) -> pd.DataFrame:
    """Return the results of finished cells of each (task, method) in a variant, one row per seed and outside instance.

    Seeds that finished after the last measurement and have their policies count as missing.

    Raises:
        UserError: nothing is measured yet, and nothing may or can be measured.
    """
    import pandas as pd

    tables = []
    for task, method in pairs:
        path = _path(results, task, method, variant)
        table = read_table(path, OUTSIDE_REGION.form) if measure_missing else usable(path, OUTSIDE_REGION)
        seeds = set() if table is None else set(table["seed"])
        new = {seed: cell for seed, cell in _finished(results, task, method, variant).items() if seed not in seeds}
        if measure_missing and new:
            log(f"{FOLDER}: playing {len(new)} policies of {task}/{method}/{variant.name}; kept in {path}")
            table = pd.concat([*([] if table is None else [table]), _measure(task, method, new)], ignore_index=True)
            write_table(results, path, table)
        if table is not None:
            tables.append(table)
    if not tables:
        raise UserError(f"not measured yet; measure it with: codesign-bench verify --measure --results {results}")
    return pd.concat(tables, ignore_index=True)


def load_outside(results: Path) -> pd.DataFrame:
    """Return the measurements of default cells, for all tasks and methods.

    Raises:
        UserError: nothing is measured yet.
    """
    varying_nothing = (cell.record for cell in reported_cells(results) if cell.record.variant == DEFAULT)
    pairs = list(dict.fromkeys((record.task, record.method) for record in varying_nothing))
    return load_or_measure(results, pairs, silent, measure_missing=False)


def _path(results: Path, task: str, method: str, variant: Variant) -> Path:
    name = "-".join([task, method, *([] if variant == DEFAULT else [variant.name])])
    return results / FOLDER / f"{name}.csv"


def _finished(results: Path, task: str, method: str, variant: Variant) -> dict[int, StoredCell]:
    """Return the finished cells with policies, by seed."""
    wanted = (task, method, variant)
    return {
        cell.record.seed: cell
        for cell in reported_cells(results)
        if (cell.record.task, cell.record.method, cell.record.variant) == wanted and cell.is_done and cell.has_policy
    }


def _measure(name: str, method: str, cells: dict[int, StoredCell]) -> pd.DataFrame:
    import pandas as pd

    task = load_task(name)
    instances = outside_instances(task)
    parts = []
    for seed, cell in cells.items():
        evaluation = evaluate(task, policy_of(cell), instances=instances)
        columns = {"return": evaluation.returns, "success": evaluation.successes.astype(int)}
        places = task.instance_space.names
        positions = {f"instance_{entry}": instances[:, index] for index, entry in enumerate(places)}
        parts.append(
            pd.DataFrame({"seed": seed, "instance": range(len(instances)), **columns, **positions}).assign(
                task=name, method=method
            )
        )
    frame = pd.concat(parts, ignore_index=True)
    return frame[[*COLUMNS, *(column for column in frame.columns if column not in COLUMNS)]]
