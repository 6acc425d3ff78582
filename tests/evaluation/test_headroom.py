"""Headroom, by sticks whose best length is known; interrupted, repeated, and measured for another policy.

Shapes: `N` evaluation instances, `P` tools, `D` design, `B` batch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from builders import store_played_cell
from codesign_bench.errors import UserError
from codesign_bench.evaluation import headroom
from codesign_bench.evaluation.headroom import (
    DESIGNER,
    OTHER,
    RANDOM,
    SEARCH,
    Budget,
    Controller,
    judgements,
    measure_cell,
    measure_instance,
    summary,
)
from codesign_bench.method import Array, Policy, Problem
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.headroom import load_design_values
from codesign_bench.storage.policies import policy_of
from codesign_bench.task import Floats, Singles, load_task
from codesign_bench.task.episodes import Tradeoff
from toy import ConstantPolicy, ToyReach

SMALL = Budget(candidates=24, popsize=6, sigma0=0.3, random_tools=4)


class _AsLongAsTheGoalIsFar(Policy):
    """A stick that touches the goal at once, held still."""

    def design(self, observation: Singles) -> Singles:
        """Return (B, 1) lengths in [-1, 1]: 0.1 m is -1, 1 m is 1. The goal, 0 to 1 m, comes as it is."""
        return np.asarray((observation[..., ToyReach().layout.goal] - 0.55) / 0.45, dtype=np.float32)

    def act(self, observation: Singles) -> Singles:
        """Return (B, 1) zeros."""
        return np.zeros((*observation.shape[:-1], 1), dtype=np.float32)

    def tensors(self) -> Mapping[str, Array]:
        """Return nothing: it learned nothing."""
        return {}


def toy_controller(length: float, speed: float = 0.0) -> Controller:
    """Return the controller of one stick for all goals, both in [-1, 1]."""
    return Controller(ConstantPolicy(np.array([length, speed])), Problem(ToyReach()))


def toy_cell(out: Path, length: float = 0.3, speed: float = 0.2) -> Path:
    """Return the folder of a finished toy cell with one stick for all goals, both in [-1, 1]."""
    return store_played_cell(out, "toy_reach", "toy_search", {"vector": np.array([length, speed])})


def read(path: Path) -> pd.DataFrame:
    """Return a table with every digit; pandas before 3.1 drops the last ones unless asked."""
    return pd.read_csv(path, float_precision="round_trip")


def stored(path: Path) -> pd.DataFrame:
    """Return a stored table, the instances in front."""
    return read(path).set_index("instance")


def test_the_best_stick_touches_every_goal_within_reach() -> None:
    # Held still, a stick of the right length earns 0 in the one step that it needs; the shortest has 0.1 m.
    controller = toy_controller(length=1.0)
    tools = controller.designs()
    for index, (goal,) in enumerate(controller.instances):
        tried = measure_instance(controller, tools, index, replace(SMALL, candidates=60))
        steps = 1 if goal > 0.95 else 5  # a stick of 1 m touches only what is farther
        assert tried.returns[0] == pytest.approx(-steps * (1.0 - goal))
        if goal >= 0.1:
            assert tried.returns.max() == pytest.approx(0.0, abs=0.01)
            assert tried.successes.max() == 1.0
        else:
            assert tried.returns.max() <= -(0.1 - goal) + 1e-9, "no stick is shorter"


def test_tools_come_in_their_order_and_every_step_counts() -> None:
    controller = toy_controller(length=1.0, speed=1.0)
    tried = measure_instance(controller, controller.designs(), 0, SMALL)
    assert tried.origins == [DESIGNER, OTHER, *[RANDOM] * 4, *[SEARCH] * 24], "all others are the same tool"
    assert tried.designs[0] == tried.designs[1] == 1.0
    # A design step, then control steps: one for a tip that touches at once, five at most.
    returns, successes, env_steps = controller.play(0, tried.designs)
    assert (returns.tolist(), successes.tolist()) == (tried.returns.tolist(), tried.successes.tolist())
    assert env_steps == tried.env_steps
    assert 2 * 30 <= env_steps <= 6 * 30


def test_where_the_designer_misses_nothing_nothing_better_is_found() -> None:
    controller = Controller(_AsLongAsTheGoalIsFar(), Problem(ToyReach()))
    tools = controller.designs()
    for index, (goal,) in enumerate(controller.instances):
        tried = measure_instance(controller, tools, index, SMALL)
        assert len(tried.of(OTHER)[0]) == len(np.unique(tools)) - 1
        assert tried.returns.max() == pytest.approx(tried.returns[0], abs=1e-6)
        gaps = [abs(max(other, 0.1) - goal) for (other,) in np.delete(controller.instances, index, axis=0)]
        assert (tried.of(OTHER)[1].max() == 1.0) == (min(gaps) < 0.05)


def test_no_candidates_leave_the_tools_of_the_designer_and_random_ones() -> None:
    controller = toy_controller(length=0.0)
    tried = measure_instance(controller, controller.designs(), 0, replace(SMALL, candidates=5))
    assert tried.origins == [DESIGNER, OTHER, *[RANDOM] * 4], "a generation has six"


def test_a_search_that_has_converged_starts_again_elsewhere() -> None:
    controller = toy_controller(length=1.0)
    tried = measure_instance(controller, controller.designs(), 0, replace(SMALL, candidates=600))
    lengths = tried.designs[[name == SEARCH for name in tried.origins], 0]
    # In one dimension it converges after some 20 generations: from then on its steps would be tiny.
    assert np.ptp(lengths[-300:]) > 0.1


def test_a_cell_with_another_reward_is_judged_by_it(tmp_path: Path, toy: None) -> None:
    cell = open_cell(toy_cell(tmp_path))
    plain = Controller(policy_of(cell), Problem(load_task("toy_reach")))
    rewarded = Controller(policy_of(cell), Problem(load_task("toy_reach"), tradeoff=Tradeoff(1.0, 1.0)))
    own = plain.designs()[:1]
    (less,), _, steps = plain.play(0, own)
    (more,), _, _ = rewarded.play(0, own)
    used = float(ToyReach().material(ToyReach().design_space.from_unit(own))[0])
    assert more - less == pytest.approx((steps - 1) * (1.0 - used))


@pytest.mark.usefixtures("toy")
def test_every_instance_has_its_row_and_none_is_worse_than_the_designer(tmp_path: Path) -> None:
    folder, lines = toy_cell(tmp_path), list[str]()
    path = measure_cell(folder, tmp_path, SMALL, lines.append)
    assert path == tmp_path / "headroom" / "toy_reach-toy_search-seed-00.csv"
    table, evaluation = stored(path), read(folder / "evaluation.csv")
    assert table["designer_return"].tolist() == pytest.approx(evaluation["return"].tolist())
    assert table["designer_success"].tolist() == evaluation["success"].tolist()
    assert table["other_return"].tolist() == table["designer_return"].tolist(), "it has one tool"
    assert table["instance_goal"].tolist() == evaluation["instance_goal"].tolist()
    for quantity in ("return", "success"):
        for other in ("designer", "other", "random"):
            assert (table[f"best_{quantity}"] >= table[f"{other}_{quantity}"]).all()
    same = table["found_by"] == DESIGNER
    assert (table.loc[same, "best_return"] == table.loc[same, "designer_return"]).all()
    assert (table.loc[~same, "best_return"] > table.loc[~same, "designer_return"]).all()
    assert set(table["candidates"]) == {24}
    assert len(lines) == 1
    header, rows = summary([path])
    assert len(header) == len(rows[0])
    assert rows[0][:2] == ["toy_reach-toy_search-seed-00", "8"]
    assert rows[0][-1] == f"{table['env_steps'].sum():,}"


@pytest.mark.usefixtures("toy")
def test_the_stored_tool_earns_what_is_stored(tmp_path: Path) -> None:
    folder = toy_cell(tmp_path)
    table = stored(measure_cell(folder, tmp_path, SMALL, [].append))
    controller = Controller(policy_of(open_cell(folder)), Problem(load_task("toy_reach")))
    for index, row in table.iterrows():
        unit = controller.problem.task.design_space.to_unit([[row["design_length"]]]).astype(np.float32)
        assert controller.play(int(str(index)), unit)[0][0] == row["best_return"]


@pytest.mark.usefixtures("toy")
def test_what_was_measured_before_an_interruption_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, added, add_rows = toy_cell(tmp_path), list[int](), headroom.add_rows

    def interrupted(results: Path, path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
        if len(added) == 3:
            raise KeyboardInterrupt
        added.append(rows[0]["instance"])
        add_rows(results, path, rows)

    whole = stored(measure_cell(folder, tmp_path / "undisturbed", SMALL, [].append))
    monkeypatch.setattr(headroom, "add_rows", interrupted)
    with pytest.raises(KeyboardInterrupt):
        measure_cell(folder, tmp_path, SMALL, [].append)
    monkeypatch.setattr(headroom, "add_rows", add_rows)
    lines: list[str] = []
    resumed = stored(measure_cell(folder, tmp_path, SMALL, lines.append))
    assert lines[0].startswith("trying other tools on 5 instances of toy_reach/toy_search/default/seed-00")
    pd.testing.assert_frame_equal(resumed, whole)
    before = (tmp_path / "headroom" / "toy_reach-toy_search-seed-00.csv").read_bytes()
    measure_cell(folder, tmp_path, SMALL, lines.append)
    assert len(lines) == 1
    assert (tmp_path / "headroom" / "toy_reach-toy_search-seed-00.csv").read_bytes() == before


@pytest.mark.usefixtures("toy")
def test_some_instances_first_and_all_of_them_later(tmp_path: Path) -> None:
    folder = toy_cell(tmp_path)
    first = stored(measure_cell(folder, tmp_path, SMALL, [].append, instances=2))
    assert first.index.tolist() == [0, 1]
    later = stored(measure_cell(folder, tmp_path, SMALL, [].append, instances=99))
    assert later.index.tolist() == list(range(8))
    pd.testing.assert_frame_equal(later[:2], first)


@pytest.mark.usefixtures("toy")
def test_another_budget_or_another_policy_is_refused(tmp_path: Path) -> None:
    folder = toy_cell(tmp_path / "one")
    path = measure_cell(folder, tmp_path / "kept", SMALL, [].append, instances=1)
    before = path.read_bytes()
    with pytest.raises(UserError, match="candidates: stored 24, requested 30"):
        measure_cell(folder, tmp_path / "kept", replace(SMALL, candidates=30), [].append)
    retrained = toy_cell(tmp_path / "other", length=0.4)
    with pytest.raises(UserError, match="policy: stored sha256:"):
        measure_cell(retrained, tmp_path / "kept", SMALL, [].append)
    assert path.read_bytes() == before


def test_numbers_do_not_depend_on_the_number_of_processes(tmp_path: Path) -> None:
    plan = np.zeros(5 + 150 * 2)
    folder, budget = store_played_cell(tmp_path, "push", "cma_es", {"plan": plan}), replace(SMALL, candidates=6)
    one, two = (
        stored(measure_cell(folder, tmp_path / str(jobs), budget, [].append, instances=2, jobs=jobs)) for jobs in (1, 2)
    )
    pd.testing.assert_frame_equal(one, two)


def test_a_folder_that_is_no_cell_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is not a cell folder"):
        measure_cell(tmp_path, tmp_path, SMALL, [].append)


def test_designs_of_the_designer_are_those_that_it_plays() -> None:
    designs: Floats = Controller(_AsLongAsTheGoalIsFar(), Problem(ToyReach())).designs()
    goals = ToyReach().evaluation_instances()
    assert designs == pytest.approx(np.clip((goals - 0.55) / 0.45, -1.0, 1.0), abs=1e-6)


class _LikesLongSticks(ConstantPolicy):
    """A stick of one length for all goals, with the opinion that a longer one is better, the more so the farther."""

    def design_values(self, observation: Singles, designs: Singles) -> Floats:
        """Return (P,) the length in [-1, 1], plus the distance of the goal."""
        return np.asarray(designs[:, 0] + observation[ToyReach().layout.goal], dtype=np.float64)


def test_what_a_policy_expects_of_designs_stands_beside_what_they_earned() -> None:
    controller = Controller(_LikesLongSticks(np.array([0.3, 0.0])), Problem(ToyReach()))
    tried = measure_instance(controller, controller.designs(), 1, SMALL)
    rows = judgements(controller, 1, tried)
    goal = controller.instances[1, 0]
    assert [row["origin"] for row in rows] == [DESIGNER] + [RANDOM] * SMALL.random_tools
    assert [row["tool"] for row in rows] == list(range(1 + SMALL.random_tools))
    played = [number for number, origin in enumerate(tried.origins) if origin in (DESIGNER, RANDOM)]
    assert [row["return"] for row in rows] == tried.returns[played].tolist()
    assert [row["value"] for row in rows] == pytest.approx((tried.designs[played, 0] + goal).tolist(), abs=1e-6)


def test_a_policy_that_does_not_judge_designs_has_no_values() -> None:
    controller = toy_controller(length=0.3)
    assert judgements(controller, 0, measure_instance(controller, controller.designs(), 0, SMALL)) == []


@pytest.mark.usefixtures("toy")
def test_the_values_of_a_finished_cell_are_kept_and_not_mixed_with_another_policys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ConstantPolicy, "design_values", _LikesLongSticks.design_values)
    measure_cell(toy_cell(tmp_path), tmp_path, SMALL, [].append, instances=3)
    table = load_design_values(tmp_path)
    assert len(table) == 3 * (1 + SMALL.random_tools)
    assert set(table["origin"]) == {DESIGNER, RANDOM}
    (path,) = (tmp_path / "design_values").glob("*.csv")
    before = path.read_bytes()
    (tmp_path / "headroom" / path.name).unlink()
    other = toy_cell(tmp_path / "other", length=0.9)
    with pytest.raises(UserError, match=r"design_values.*was measured otherwise \(policy: stored sha256"):
        measure_cell(other, tmp_path, SMALL, [].append)
    assert path.read_bytes() == before
