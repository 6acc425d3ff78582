"""Reference points, by numbers that can be checked by hand: a stick that shall touch a goal on a line.

Shapes: `N` evaluation instances.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd
import pytest

from builders import sweep, toy_cells
from codesign_bench import registry
from codesign_bench.evaluation import reference_points
from codesign_bench.evaluation.reference_points import (
    Point,
    best_known,
    instance_table,
    measure,
    measure_missing,
    renew_best_known,
)
from codesign_bench.storage.best_known import BestKnown, Episode, store
from codesign_bench.storage.reference_points import (
    COLUMNS,
    FILE,
    INSTANCE_COLUMNS,
    INSTANCES_FILE,
    load_reference_points,
)
from codesign_bench.task import Behaviour, Floats, Singles, Task, load_task, task_names
from codesign_bench.task.plans import plan_size
from toy import ToyReach

GOALS = (0.2, 0.5, 0.8, 0.82)
"""All within reach of a stick of 0.1 to 1 m."""


class _Fitting(Behaviour):
    """A stick as long as the goal is far, held still."""

    def design(self, observation: Singles) -> Singles:
        """Return (B, 1) lengths in [-1, 1]: 0.1 m is -1, 1 m is 1. The goal, 0 to 1 m, comes as it is."""
        goals = observation[..., ToyReach().layout.goal]
        return np.asarray((goals - 0.55) / 0.45, dtype=np.float32)

    def act(self, observation: Singles) -> Singles:
        """Return (B, 1) zeros."""
        return np.zeros((*observation.shape[:-1], 1), dtype=np.float32)


class _Scripted(ToyReach):
    """The toy task with a script that solves it, and four goals."""

    num_evaluation_instances = len(GOALS)
    runs: ClassVar[list[str]] = []

    def sample_instances(self, rng: np.random.Generator, count: int) -> Floats:
        """Return the goals."""
        return np.resize(GOALS, count)[:, None]

    def script(self) -> Behaviour:
        """Return sticks that fit."""
        return _Fitting()


def by_name(points: list[Point]) -> dict[str, Point]:
    """Return points by their names."""
    return {point.name: point for point in points}


def test_a_stick_held_still_earns_its_distance_until_the_time_limit() -> None:
    task = ToyReach()
    idle = by_name(measure(task))["idle"]
    assert idle.tools == task.num_evaluation_instances, "every instance has a random tool of its own"
    # 5 steps at a distance d earn -5 d; a tip within 0.05 m of the goal ends the episode after one step.
    assert (idle.returns >= -5.0).all()
    assert ((idle.returns > -0.05) == (idle.successes == 1.0)).all()
    assert (idle.returns[idle.successes == 0.0] <= -5.0 * 0.05).all()


def test_a_task_without_a_script_gets_what_is_possible() -> None:
    points = by_name(measure(ToyReach()))
    assert list(points) == ["idle", "random_tool"]
    assert points["random_tool"].source == "random tools, random controls"


def test_a_script_that_fits_its_tools_solves_every_instance() -> None:
    points = by_name(measure(_Scripted(), random_tools=50, finalists=5))
    assert list(points) == ["idle", "random_tool", "script", "best_single_tool", "any_tool"]
    assert points["script"].returns == pytest.approx(np.zeros(4), abs=1e-6)
    assert points["script"].successes.tolist() == [1.0] * 4
    assert points["random_tool"].returns.tolist() == points["idle"].returns.tolist(), "this script's controller idles"


def test_the_best_single_tool_is_the_best_of_those_that_were_tried() -> None:
    # Sticks of 0.2, 0.5, 0.8 and 0.82 m, the script's own, and no others. Held still, one of 0.8 m touches the last
    # two goals at once, 0.00 and 0.02 m away, and stays 0.6 and 0.3 m from the first two for 5 steps.
    points = by_name(measure(_Scripted(), random_tools=0, finalists=4))
    single, any_tool = points["best_single_tool"], points["any_tool"]
    assert single.tools == 4
    assert single.source == "tool 2 by return, tool 2 by success, of 4"
    assert single.returns == pytest.approx([-3.0, -1.5, 0.0, -0.02], abs=1e-6)
    assert single.successes.tolist() == [0.0, 0.0, 1.0, 1.0]
    assert any_tool.returns == pytest.approx(np.zeros(4), abs=1e-6)
    assert list(any_tool.sources) == ["tool 0", "tool 1", "tool 2", "tool 3"]


def test_tools_that_were_tried_before_choose_the_finalists_and_are_not_played_again() -> None:
    # The table says that the shortest stick earns most, which is wrong; it is the finalist, and its returns are played.
    tool, goal = (index.ravel() for index in np.indices((4, 4)))
    tried = pd.DataFrame({"tool": tool, "goal": goal, "return": -tool})
    single = by_name(measure(_Scripted(), random_tools=0, finalists=1, tried=tried))["best_single_tool"]
    assert single.source == "tool 0 by return, tool 0 by success, of 4"
    assert single.returns == pytest.approx([0.0, -1.5, -3.0, -3.1], abs=1e-6)
    other = by_name(measure(_Scripted(), random_tools=0, finalists=1, tried=tried[:8]))["best_single_tool"]
    assert other.source == "tool 2 by return, tool 2 by success, of 4", "a table of other goals does not choose"


def test_only_finalists_meet_the_instances_after_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference_points, "GOALS", 2)
    played: list[int] = []
    original = reference_points.play_tools

    def counted(task: Task, designs: Floats, *rest: Any) -> tuple[Floats, Floats, Floats]:
        played.append(len(designs))
        return original(task, designs, *rest)

    monkeypatch.setattr(reference_points, "play_tools", counted)
    single = by_name(measure(_Scripted(), random_tools=4, finalists=1))["best_single_tool"]
    assert played == [(4 + 2) * 2, 1 * 4]
    assert single.returns.shape == (4,)


def point(name: str, returns: list[float], successes: list[float]) -> Point:
    """Return a point of the four goals."""
    return Point(name, np.array(returns), np.array(successes), 1, "a test")


def test_the_best_known_is_the_highest_of_every_instance(tmp_path: Path) -> None:
    points = [point("idle", [0.0, 5.0, 1.0, 0.0], [0, 0, 1, 0]), point("script", [1.0, 2.0, 3.0, 0.0], [1, 0, 0, 0])]
    best = best_known(_Scripted(), points, tmp_path)
    assert best.returns.tolist() == [1.0, 5.0, 3.0, 0.0]
    assert best.successes.tolist() == [1.0, 0.0, 1.0, 0.0]
    assert list(best.sources) == ["script", "idle", "script", "idle"]


def test_stored_episodes_count_in_return_and_in_success(tmp_path: Path) -> None:
    task, known = _Scripted(), BestKnown()
    plan = np.zeros(plan_size(task), dtype=np.float32)
    for instance, earned, solved in ((1, 9.0, False), (1, 4.0, True), (2, -1.0, False)):
        known.offer(Episode(instance, earned, solved, 5, "a search", plan))
    store(tmp_path, task, known)
    points = [point("idle", [0.0, 5.0, 1.0, 0.0], [0, 0, 1, 0])]
    best = best_known(task, points, tmp_path)
    assert best.returns.tolist() == [0.0, 9.0, 1.0, 0.0]
    assert best.successes.tolist() == [0.0, 1.0, 1.0, 0.0]
    assert list(best.sources) == ["idle", "a search", "idle", "idle"]
    assert best.source == "the highest of every instance, 0 cells and stored episodes among them"


@pytest.mark.usefixtures("toy")
def test_points_that_were_measured_are_renewed_alone(tmp_path: Path) -> None:
    task = load_task("toy_reach")
    assert not renew_best_known(tmp_path, task), "nothing was measured"
    measure_missing(tmp_path, ["toy_reach"], [].append)
    before = load_reference_points(tmp_path).set_index("point")
    known = BestKnown()
    for instance in range(task.num_evaluation_instances):
        known.offer(Episode(instance, 1.0, True, 1, "a search", np.zeros(plan_size(task), dtype=np.float32)))
    store(tmp_path, task, known)
    assert renew_best_known(tmp_path, task)
    after = load_reference_points(tmp_path).set_index("point")
    assert after.loc["best_known", ["return_mean", "success_rate"]].tolist() == [1.0, 1.0]
    pd.testing.assert_frame_equal(after.drop(index="best_known"), before.drop(index="best_known"))


@pytest.mark.usefixtures("toy")
def test_finished_cells_count_if_they_met_the_same_instances(tmp_path: Path) -> None:
    sweep(toy_cells(seeds=2), tmp_path)
    task = load_task("toy_reach")
    tables = [pd.read_csv(path) for path in sorted(tmp_path.rglob("evaluation.csv"))]
    points = measure(task)
    best = best_known(task, points, tmp_path)
    rows = [*(point.returns for point in points), *(table["return"] for table in tables)]
    assert best.returns == pytest.approx(np.max(rows, axis=0))
    assert (best.tools, best.source) == (4, "the highest of every instance, 2 cells among them")
    for path in tmp_path.rglob("evaluation.csv"):
        pd.read_csv(path).assign(instance_goal=0.5).to_csv(path, index=False)
    assert best_known(task, points, tmp_path).tools == 2


@pytest.mark.usefixtures("toy")
def test_what_was_measured_is_kept_and_the_best_known_is_renewed(tmp_path: Path) -> None:
    told: list[str] = []
    measure_missing(tmp_path, ["toy_reach"], told.append)
    first = load_reference_points(tmp_path)
    assert tuple(first.columns) == COLUMNS
    assert first["point"].tolist() == ["idle", "random_tool", "best_known"]
    instances = pd.read_csv(tmp_path / INSTANCES_FILE)
    assert tuple(instances.columns) == INSTANCE_COLUMNS
    means = instances.groupby("point")[["return", "success"]].mean().loc[first["point"]]
    assert means["return"].tolist() == pytest.approx(first["return_mean"].tolist())
    assert means["success"].tolist() == pytest.approx(first["success_rate"].tolist())
    before = (tmp_path / FILE).read_bytes(), (tmp_path / INSTANCES_FILE).read_bytes()
    measure_missing(tmp_path, ["toy_reach"], told.append)
    assert ((tmp_path / FILE).read_bytes(), (tmp_path / INSTANCES_FILE).read_bytes()) == before
    assert len(told) == 1
    sweep(toy_cells(), tmp_path)
    measure_missing(tmp_path, ["toy_reach"], told.append)
    assert len(told) == 1
    assert load_reference_points(tmp_path).set_index("point").loc["best_known", "tools"] == 3


@pytest.mark.usefixtures("toy")
def test_another_version_of_a_scene_is_measured_anew_and_other_tasks_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measure_missing(tmp_path, ["toy_reach"], [].append)
    for path in (tmp_path / FILE, tmp_path / INSTANCES_FILE):
        table = pd.read_csv(path)
        pd.concat([table, table.assign(task="another")]).to_csv(path, index=False)
    monkeypatch.setattr(type(load_task("toy_reach")), "version", 2, raising=False)
    told: list[str] = []
    measure_missing(tmp_path, ["toy_reach"], told.append)
    assert len(told) == 1
    versions = load_reference_points(tmp_path).groupby("task")["task_version"].unique()
    assert {task: found.tolist() for task, found in versions.items()} == {"toy_reach": [2], "another": [1]}


@pytest.mark.usefixtures("toy")
def test_what_is_there_can_be_measured_again(tmp_path: Path) -> None:
    told: list[str] = []
    for again in (False, True):
        measure_missing(tmp_path, ["toy_reach"], told.append, again=again)
    assert len(told) == 2


def test_numbers_do_not_depend_on_the_number_of_processes() -> None:
    task = load_task(task_names()[0])
    task.num_evaluation_instances = 4  # type: ignore[misc]
    one, two = (instance_table(task, measure(task, 3, 2, jobs)) for jobs in (1, 2))
    pd.testing.assert_frame_equal(one, two)


@pytest.mark.parametrize("name", registry.names("tasks"))
def test_points_of_every_task_are_ordered(name: str, tmp_path: Path) -> None:
    task = load_task(name)
    task.num_evaluation_instances = 4  # type: ignore[misc]
    points = measure(task, random_tools=2, finalists=2)
    found = by_name([*points, best_known(task, points, tmp_path)])
    best = found.pop("best_known")
    assert {"idle", "random_tool"} <= set(found)
    for other in found.values():
        assert (best.returns >= other.returns).all(), other.name
        assert (best.successes >= other.successes).all(), other.name
    if "any_tool" in found:
        assert (found["any_tool"].returns >= found["best_single_tool"].returns).all()
