"""What policies reach in the regions that some of them were not trained on, on instances drawn inside each region.

A region may be easier than the rest of the task. What a policy loses by not having seen it is therefore measured
against policies of the same method that were trained on everything, on the same instances. The tables are beside the
cells, one per task and method; every finished policy is played once on each region.

Shapes: `N` instances, `I` instance.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.seeding import generator
from codesign_bench.storage.cells import StoredCell, find_cells
from codesign_bench.storage.measurements import CUTOUT_REGIONS, usable_tables
from codesign_bench.storage.policies import policy_of
from codesign_bench.storage.tables import read_table, write_table
from codesign_bench.task import EVALUATION_SEED, Floats, Task, load_task

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "cutout_regions"
INSTANCES = 128
"""Instances drawn inside of each region, as many as a task's own evaluation has (ours)."""
COLUMNS = ("task", "method", "cutout", "region", "seed", "instance", "return", "success")
"""`cutout` is the fraction that the policy was trained without, 0 for none; `region` the fraction played on."""


def region_instances(task: Task, fraction: float) -> Floats:
    """Return `INSTANCES` instances (N, I) inside the cutout region of a fraction, the same in every call.

    They have the distribution of the task's instances, restricted to the region.

    Raises:
        UserError: the task has no positions.
    """
    rng = generator(EVALUATION_SEED, f"cutout region {fraction:g} of {task.name}")
    found = task.sample_instances(rng, 0)
    while len(found) < INSTANCES:
        drawn = task.sample_instances(rng, INSTANCES)
        found = np.concatenate([found, drawn[task.in_cutout(drawn, fraction)]])
    return found[:INSTANCES]


def measure_cutout_regions(results: Path, task: str, method: str, fractions: Sequence[float], log: Log) -> None:
    """Play every finished policy on the region that it was trained without, and those trained on everything on each.

    What was played before is kept, also where its policy is gone.
    """
    import pandas as pd

    path = results / FOLDER / f"{task}-{method}.csv"
    table = read_table(path, CUTOUT_REGIONS.form)
    known = set() if table is None else set(zip(table["cutout"], table["region"], table["seed"], strict=True))
    parts = [] if table is None else [table]
    for region in fractions:
        for cutout in (0.0, region):
            cells = _finished(results, task, method, cutout)
            new = {seed: cell for seed, cell in cells.items() if (cutout, region, seed) not in known}
            if new:
                log(
                    f"{FOLDER}: playing {len(new)} policies of {task}/{method} on the region {region:g}; kept in {path}"
                )
                parts += [_played(task, method, cutout, region, seed, cell) for seed, cell in new.items()]
    if len(parts) > (table is not None):
        write_table(results, path, pd.concat(parts, ignore_index=True))


def load_cutout_regions(results: Path) -> pd.DataFrame:
    """Return what was measured, all tasks and methods below each other, with the columns `COLUMNS`.

    Raises:
        UserError: nothing is measured yet.
    """
    import pandas as pd

    tables = usable_tables(results, CUTOUT_REGIONS)
    if not tables:
        raise UserError(f"not measured yet; measure it with: codesign-bench verify --measure --results {results}")
    return pd.concat(tables, ignore_index=True)


def _finished(results: Path, task: str, method: str, cutout: float) -> dict[int, StoredCell]:
    """Return the finished cells trained without a fraction of the region, with stored policies, by seed."""
    wanted = (task, method, DEFAULT if cutout == 0.0 else Variant.of(cutout=cutout))
    return {
        cell.record.seed: cell
        for cell in find_cells(results)
        if (cell.record.task, cell.record.method, cell.record.variant) == wanted and cell.is_done and cell.has_policy
    }


def _played(name: str, method: str, cutout: float, region: float, seed: int, cell: StoredCell) -> pd.DataFrame:
    import pandas as pd

    task = load_task(name)
    evaluation = evaluate(task, policy_of(cell), instances=region_instances(task, region))
    columns = {
        "task": name,
        "method": method,
        "cutout": cutout,
        "region": region,
        "seed": seed,
        "instance": range(INSTANCES),
        "return": evaluation.returns,
        "success": evaluation.successes.astype(int),
    }
    return pd.DataFrame(columns)[list(COLUMNS)]
