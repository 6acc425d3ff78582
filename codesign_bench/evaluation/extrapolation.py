"""What trained policies reach on positions just outside the region that they were trained on (paper, section 5.2).

The evaluation instances of a task lie inside its region; these lie around it, in a rim of `RIM` times its extent. The
tables lie beside the cells, one per task, method and variant; every finished policy is played once.

Shapes: `N` instances, `I` instance, `B` batch, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.seeding import generator
from codesign_bench.storage.files import write_bytes
from codesign_bench.storage.policies import load_policy
from codesign_bench.storage.results import DEFAULT_VARIANT, DONE, POLICY_FILE, find_cells
from codesign_bench.task import EVALUATION_SEED, Floats, Task, load_task
from codesign_bench.task.behaviours import Idle

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "outside_region"
RIM = 0.1
"""How far instances lie outside at most, as a share of the region's extent along each axis (ours)."""
INSTANCES = 64
"""Instances drawn around the region (ours)."""
COLUMNS = ("task", "method", "seed", "instance", "return", "success")


def outside_instances(task: Task) -> Floats:
    """Return up to `INSTANCES` instances (N, I) around the training region, without those that doing nothing solves.

    Positions are drawn from around their ranges, all other entries from theirs.

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
    results: Path,
    pairs: Sequence[tuple[str, str]],
    say: Callable[[str], None],
    measure_missing: bool,
    variant: str = DEFAULT_VARIANT,
) -> pd.DataFrame:
    """Return what the finished cells of each (task, method) in a variant reach outside, one row per seed and instance.

    Seeds that were finished since, and whose policies are there, count as missing.

    Raises:
        UserError: nothing is measured yet and nothing may be, or can be, measured.
    """
    import pandas as pd

    frames = []
    for task, method in pairs:
        path = results / FOLDER / f"{'-'.join([task, method, *([] if variant == DEFAULT_VARIANT else [variant])])}.csv"
        table = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=list(COLUMNS))
        seeds = set(table["seed"])
        new = {seed: cell for seed, cell in _finished(results, task, method, variant).items() if seed not in seeds}
        if measure_missing and new:
            say(f"{FOLDER}: playing {len(new)} policies of {task}/{method}/{variant}; kept in {path}")
            table = pd.concat([*([table] if len(table) else []), _measure(task, method, new)], ignore_index=True)
            path.parent.mkdir(exist_ok=True)
            write_bytes(path, table.to_csv(index=False, lineterminator="\n").encode())
        if len(table):
            frames.append(table)
    if not frames:
        raise UserError(f"not measured yet; measure it with: codesign-bench verify --measure --results {results}")
    return pd.concat(frames, ignore_index=True)


def _finished(results: Path, task: str, method: str, variant: str) -> dict[int, Path]:
    """Return the folders of finished cells that hold their policies, by seed."""
    return {
        int(content["seed"]): folder
        for folder, content in find_cells(results)
        if (content["task"], content["method"], content["variant"]) == (task, method, variant)
        and content["status"] == DONE
        and (folder / POLICY_FILE).exists()
    }


def _measure(name: str, method: str, cells: dict[int, Path]) -> pd.DataFrame:
    import pandas as pd

    task = load_task(name)
    instances = outside_instances(task)
    parts = []
    for seed, folder in cells.items():
        evaluation = evaluate(task, load_policy(folder), instances=instances)
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
