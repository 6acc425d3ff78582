"""Reference points of a task: what idling, random tools, the script and one tool reach, and the best that is known.

Every point is played on the task's evaluation instances, on which methods are judged, too. Nothing learns here; the
best that is known also counts the finished cells of the results folder.

Shapes: `N` evaluation instances, `I` instance, `K` tools, `F` finalists among them, `D` design.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from codesign_bench.cell.variant import DEFAULT
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.evaluation.expected import Work, steps_per_second
from codesign_bench.evaluation.sensitivity import GOALS, RANDOM_TOOLS, play_tools, stored_table, tools_of
from codesign_bench.registry import in_order
from codesign_bench.seeding import generator
from codesign_bench.storage.best_known import load_best_known
from codesign_bench.storage.cells import StoredCell, find_cells
from codesign_bench.storage.measurements import REFERENCE_INSTANCES, REFERENCE_POINTS
from codesign_bench.storage.reading import UnusableFile
from codesign_bench.storage.reference_points import (
    ANY_TOOL,
    BEST_KNOWN,
    COLUMNS,
    FILE,
    IDLE,
    INSTANCE_COLUMNS,
    INSTANCES_FILE,
    RANDOM_TOOL,
    SCRIPT,
    SINGLE_TOOL,
)
from codesign_bench.storage.tables import read_table, write_tables
from codesign_bench.task import EVALUATION_SEED, Behaviour, Floats, Task, load_task
from codesign_bench.task.behaviours import Idle, Joined, RandomBehaviour

if TYPE_CHECKING:
    import pandas as pd

FINALISTS = 16
"""Tools that play all evaluation instances, chosen among all tools by their returns on the first `GOALS` (ours)."""


@dataclass(frozen=True)
class Point:
    """What one way to play reaches on each evaluation instance."""

    name: str
    returns: Floats
    """(N,)"""
    successes: Floats
    """(N,) 0 or 1."""
    tools: int
    """Tools that were played; for the best known, results from which it is taken."""
    source: str
    """Who played, in words."""
    sources: Sequence[str] = ()
    """The same of each instance, where it differs."""


def version_of(task: Task) -> int:
    """Return the version of a task's scene; points of another version count as missing."""
    return int(getattr(task, "version", 1))


def measure(
    task: Task,
    random_tools: int = RANDOM_TOOLS,
    finalists: int = FINALISTS,
    jobs: int = 1,
    tried: pd.DataFrame | None = None,
) -> list[Point]:
    """Return the points that need no cells.

    A task without a script has no script and no single tool; its random tools have random controls.

    Args:
        task: what is played.
        random_tools: tools that compete to be the best single one, besides the script's own for a few goals.
        finalists: how many of them play all instances.
        jobs: processes that play side by side; the numbers do not depend on it.
        tried: rows as `sensitivity.measure` gives them, by which finalists are chosen if they are of the same tools and
            instances; None: they are played.
    """
    points = [_played(task, IDLE, Joined(_random(task, "tools"), Idle(task)), "random tools, held still")]
    try:
        script = task.script()
    except UserError:
        moved = Joined(_random(task, "tools"), _random(task, "controls"))
        return [*points, _played(task, RANDOM_TOOL, moved, "random tools, random controls")]
    moved = Joined(_random(task, "tools"), script)
    return [
        *points,
        _played(task, RANDOM_TOOL, moved, "random tools, the script's controller"),
        _played(task, SCRIPT, script, "hand-written tools and controller"),
        *_single_tools(task, random_tools, finalists, jobs, tried),
    ]


def best_known(task: Task, points: Sequence[Point], results: Path) -> Point:
    """Return the best result of each evaluation instance, in return and in success.

    Args:
        task: whose instances they are.
        points: what was measured.
        results: its best known episodes count, too, and its finished cells that vary nothing, if they were judged on
            the same instances.

    Raises:
        UnusableFile: the table of best known episodes cannot be used.
    """
    cells, episodes = list(_cells(task, results)), _episodes(task, results)
    points = [*points, *episodes]
    returns = np.array([*(point.returns for point in points), *(table["return"] for _, table in cells)])
    successes = np.array([*(point.successes for point in points), *(table["success"] for _, table in cells)])
    names = [[point.sources[i] if point.sources else point.name for point in points] for i in range(returns.shape[1])]
    sources = [[*own, *(name for name, _ in cells)] for own in names]
    # The best single tool is one of those that `ANY_TOOL` counts.
    tools = sum(point.tools if point.name == ANY_TOOL else 1 for point in points if point.name != SINGLE_TOOL)
    words = f"the highest of every instance, {len(cells)} cells{' and stored episodes' * len(episodes)} among them"
    best = [own[winner] for own, winner in zip(sources, returns.argmax(axis=0), strict=True)]
    return Point(BEST_KNOWN, returns.max(axis=0), successes.max(axis=0), tools + len(cells), words, best)


def _episodes(task: Task, results: Path) -> list[Point]:
    """Return what the best known episodes of the folder reach, as one point; none where there are no episodes."""
    known = load_best_known(results, task).episodes
    if not known:
        return []
    count = task.num_evaluation_instances
    returns, successes, sources = np.full(count, -np.inf), np.zeros(count), [BEST_KNOWN] * count
    for instance, episodes in known.items():
        returns[instance], sources[instance] = episodes[0].earned, episodes[0].source
        successes[instance] = max(episode.solved for episode in episodes)
    return [Point(BEST_KNOWN, returns, successes, 1, "stored episodes", sources)]


def measure_missing(results: Path, tasks: Iterable[str], log: Log, *, again: bool = False, jobs: int = 1) -> None:
    """Measure the points of `tasks` that are missing below `results`, and renew the best known from its cells.

    Args:
        results: the folder; points of other tasks are kept.
        tasks: names.
        log: shows what is played.
        again: also measure what is there.
        jobs: processes that play side by side.

    Raises:
        UserError: the folder cannot be written, or what it has cannot be used; nothing of it is replaced then.
    """
    for name in tasks:
        known = _known(results)  # read before anything is played
        task = load_task(name)
        points = [] if again else _stored(task, results)
        if not points:
            work = expected_work(results, task, again=again, jobs=jobs).line()
            log(f"playing the reference points of {name}: {work}; kept in {results / FILE}")
            points = measure(task, jobs=jobs, tried=None if again else stored_table(results, name))
        _write(results, task, known, points)


def expected_work(results: Path, task: Task, *, again: bool = False, jobs: int = 1) -> Work:
    """Return what `measure_missing` would play on a task; nothing if the points are there.

    Raises:
        UnusableFile: what the folder has cannot be used.
    """
    count, episodes = task.num_evaluation_instances, 0
    if again or not _stored(task, results):
        episodes = 2 * count
        try:
            task.script()
        except UserError:
            pass
        else:
            episodes += count + FINALISTS * count
            if again or stored_table(results, task.name) is None:
                first = task.evaluation_instances()[:GOALS]
                episodes += len(tools_of(task, first, RANDOM_TOOLS)) * len(first)
    return Work(task, episodes, steps_per_second(task), jobs)


def renew_best_known(results: Path, task: Task) -> bool:
    """Renew the best known of a task whose points were measured; return whether they were.

    Raises:
        UserError: the folder cannot be written, or what it has cannot be used.
    """
    known, points = _known(results), _stored(task, results)
    if points:
        _write(results, task, known, points)
    return bool(points)


def _write(results: Path, task: Task, known: Mapping[str, pd.DataFrame | None], points: Sequence[Point]) -> None:
    """Replace the points of a task in both tables, and add the best known."""
    points = [*points, best_known(task, points, results)]
    new = {FILE: summary_table(task, points), INSTANCES_FILE: instance_table(task, points)}
    write_tables(results, {results / file: _replaced(known[file], task.name, table) for file, table in new.items()})


def summary_table(task: Task, points: Sequence[Point]) -> pd.DataFrame:
    """Return one row per point, with `COLUMNS`."""
    import pandas as pd

    rows = [
        {
            "task": task.name,
            "task_version": version_of(task),
            "point": point.name,
            "return_mean": float(point.returns.mean()),
            "success_rate": float(point.successes.mean()),
            "instances": len(point.returns),
            "tools": point.tools,
            "source": point.source,
        }
        for point in points
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def instance_table(task: Task, points: Sequence[Point]) -> pd.DataFrame:
    """Return one row per point and evaluation instance, with `INSTANCE_COLUMNS`."""
    import pandas as pd

    tables = [
        pd.DataFrame(
            {
                "task": task.name,
                "task_version": version_of(task),
                "point": point.name,
                "instance": range(len(point.returns)),
                "return": point.returns,
                "success": point.successes.astype(int),
                "source": list(point.sources) or point.name,
            },
            columns=list(INSTANCE_COLUMNS),
        )
        for point in points
    ]
    return pd.concat(tables, ignore_index=True)


def _random(task: Task, what: str) -> RandomBehaviour:
    """Return a random behaviour that is the same in every call, and another for other words."""
    return RandomBehaviour(task, generator(EVALUATION_SEED, f"reference {what} for {task.name}"))


def _played(task: Task, name: str, behaviour: Behaviour, source: str) -> Point:
    evaluation = evaluate(task, behaviour)
    tools = len(np.unique(evaluation.designs, axis=0))
    return Point(name, evaluation.returns, evaluation.successes.astype(np.float64), tools, source)


def single_tool(task: Task, instances: Floats, jobs: int = 1) -> Floats:
    """Return the normalised tool (D,) with the highest mean return on `instances` (N, I) with the script's controller.

    Tools compete as for the point `best_single_tool`, but on any instances, e.g. those of validation.

    Raises:
        UserError: the task has no script.
    """
    tools = _compete(task, instances, RANDOM_TOOLS, FINALISTS, jobs, None)
    best: Floats = tools.designs[tools.chosen[tools.returns.mean(axis=1).argmax()]]
    return best


def _single_tools(
    task: Task, random_tools: int, finalists: int, jobs: int, tried: pd.DataFrame | None
) -> Iterator[Point]:
    """Yield what the best single tool reaches, and what the best tool of each instance does.

    The single tool's return and success are the highest means that one tool reaches, and need not be those of the same
    tool.
    """
    tools = _compete(task, task.evaluation_instances(), random_tools, finalists, jobs, tried)
    designs, chosen, returns, successes = tools.designs, tools.chosen, tools.returns, tools.successes
    earns, solves = int(returns.mean(axis=1).argmax()), int(successes.mean(axis=1).argmax())
    source = f"tool {chosen[earns]} by return, tool {chosen[solves]} by success, of {len(designs)}"
    yield Point(SINGLE_TOOL, returns[earns], successes[solves], len(designs), source)
    sources = [f"tool {tool}" for tool in chosen[returns.argmax(axis=0)]]
    source = f"for each instance the best of {len(chosen)} tools, the script's controller"
    yield Point(ANY_TOOL, returns.max(axis=0), successes.max(axis=0), len(chosen), source, sources)


class _Tools(NamedTuple):
    """Tools that competed, and what the best of them reached."""

    designs: Floats
    """(K, D) normalised, all of them."""
    chosen: NDArray[np.intp]
    """(F,) numbers of the finalists, the best at first sight first."""
    returns: Floats
    """(F, N)."""
    successes: Floats
    """(F, N)."""


def _compete(
    task: Task, instances: Floats, random_tools: int, finalists: int, jobs: int, tried: pd.DataFrame | None
) -> _Tools:
    """Let all tools play the first `GOALS` of `instances` (N, I), and the best of them all instances."""
    first = instances[:GOALS]
    designs = tools_of(task, first, random_tools)
    if tried is not None and len(tried) == len(designs) * len(first):
        early = tried.pivot(index="tool", columns="goal", values="return").to_numpy()
    else:
        early, _ = _play_all(task, designs, first, jobs)
    # What was played before chooses finalists and no more, so that an earlier scene cannot leave its numbers here.
    chosen = np.argsort(-early.mean(axis=1), kind="stable")[:finalists]
    return _Tools(designs, chosen, *_play_all(task, designs[chosen], instances, jobs))


def _play_all(task: Task, designs: Floats, instances: Floats, jobs: int) -> tuple[Floats, Floats]:
    """Return the returns and successes (K, N) of every tool (K, D) on every instance (N, I)."""
    shape = len(designs), len(instances)
    tool, instance = (index.ravel() for index in np.indices(shape))
    _, returns, successes = play_tools(task, designs[tool], instances[instance], jobs)
    return returns.reshape(shape), successes.reshape(shape)


def _cells(task: Task, results: Path) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield name and last evaluation of each finished cell that was judged on the task's instances."""
    instances, columns = task.evaluation_instances(), [f"instance_{name}" for name in task.instance_space.names]
    for cell in find_cells(results) if results.is_dir() else ():
        if not _counts(cell, task):
            continue
        try:
            table = cell.evaluation()
        except UnusableFile:
            continue
        if table is None:
            continue
        same = len(table) == len(instances) and set(columns) <= set(table.columns)
        if same and np.allclose(table[columns], instances):
            yield f"{cell.record.method} seed {cell.record.seed}", table


def _counts(cell: StoredCell, task: Task) -> bool:
    """Return whether a cell is finished, varies nothing and belongs to this version of the task."""
    record = cell.record
    own = (record.task, record.variant, getattr(record, "task_version", 1))
    return cell.is_done and own == (task.name, DEFAULT, version_of(task))


def _stored(task: Task, results: Path) -> list[Point]:
    """Return the points of this version of the task that were measured before, without the best known."""
    summary, instances = _known(results).values()
    if summary is None or instances is None:
        return []
    points = []
    for row in summary[_own(summary, task)].to_dict("records"):
        rows = instances[_own(instances, task) & (instances["point"] == row["point"])].sort_values("instance")
        if len(rows) != task.num_evaluation_instances:
            return []
        returns, successes = (rows[name].to_numpy(dtype=np.float64) for name in ("return", "success"))
        points.append(Point(row["point"], returns, successes, row["tools"], row["source"], rows["source"].tolist()))
    return [point for point in points if point.name != BEST_KNOWN]


def _own(table: pd.DataFrame, task: Task) -> pd.Series[bool]:
    """Return which rows are of this version of the task."""
    return (table["task"] == task.name) & (table["task_version"] == version_of(task))


def _known(results: Path) -> dict[str, pd.DataFrame | None]:
    """Return both tables by their names, None where there is none.

    Raises:
        UnusableFile: one cannot be used.
    """
    kinds = {FILE: REFERENCE_POINTS, INSTANCES_FILE: REFERENCE_INSTANCES}
    return {name: read_table(results / name, kind.form) for name, kind in kinds.items()}


def _replaced(known: pd.DataFrame | None, name: str, table: pd.DataFrame) -> pd.DataFrame:
    """Put the rows of one task in place of those that a table has, tasks in the order of listings."""
    import pandas as pd

    if known is not None:
        table = pd.concat([known[known["task"] != name], table], ignore_index=True)
    order = in_order("tasks", table["task"])
    return table.sort_values("task", key=lambda tasks: tasks.map(order.index), kind="stable")
