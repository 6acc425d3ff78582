"""Instances outside the training region: where they lie, and what policies reach there, measured once."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.evaluation.extrapolation import INSTANCES, RIM, load_or_measure, outside_instances
from codesign_bench.figures.generalization import OUTSIDE, START, outcomes_by_region
from codesign_bench.figures.source import Request
from codesign_bench.storage.layout import POLICY_FILE
from codesign_bench.task import load_task

pytestmark = pytest.mark.usefixtures("toy")

RUN = ("run", "--method", "toy_search", "--task", "toy_reach", "--steps", "60", "--set", "evaluations=1")
PAIRS = [("toy_reach", "toy_search")]


def test_instances_lie_around_the_region_and_are_always_the_same() -> None:
    task = load_task("toy_reach")
    goals = outside_instances(task)[:, 0]
    assert ((goals < 0.0) | (goals > 1.0)).all()
    assert goals.min() >= -RIM
    assert goals.max() <= 1.0 + RIM
    assert (goals < 0.0).any()
    assert len(goals) == INSTANCES
    assert (goals == outside_instances(task)[:, 0]).all()


def test_instances_that_doing_nothing_solves_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    # Held still, the stick of 0.55 m then touches goals from 0.05 to 1.05 m.
    monkeypatch.setattr("toy.TOLERANCE", 0.5)
    goals = outside_instances(load_task("toy_reach"))[:, 0]
    assert 0 < len(goals) < INSTANCES
    assert ((goals < 0.0) | (goals > 1.05)).all()


def test_tasks_without_positions_have_no_outside() -> None:
    with pytest.raises(UserError, match="positions"):
        outside_instances(load_task("scoop"))


def test_policies_are_measured_once_for_each_set_of_finished_seeds(tmp_path: Path) -> None:
    told: list[str] = []
    assert main([*RUN, "--seeds", "1", "--out", str(tmp_path)]) == 0
    with pytest.raises(UserError, match="--measure"):
        load_or_measure(tmp_path, PAIRS, told.append, measure_missing=False)
    first = load_or_measure(tmp_path, PAIRS, told.append, measure_missing=True)
    assert len(first) == INSTANCES
    assert set(first["seed"]) == {0}
    again = load_or_measure(tmp_path, PAIRS, told.append, measure_missing=True)
    pd.testing.assert_frame_equal(first, again)
    assert len(told) == 1
    assert main([*RUN, "--seeds", "2", "--out", str(tmp_path)]) == 0
    assert set(load_or_measure(tmp_path, PAIRS, told.append, measure_missing=True)["seed"]) == {0, 1}
    # The toy's reward is minus the distance of tip and goal, so a return is never positive.
    assert (first["return"] <= 0.0).all()
    assert first["success"].isin([0, 1]).all()


def test_the_figure_of_generalisation_plays_every_policy_around_the_region_once(tmp_path: Path) -> None:
    told: list[str] = []
    assert main([*RUN, "--seeds", "2", "--out", str(tmp_path)]) == 0
    assert main([*RUN, "--seeds", "1", "--cutout", "0.4", "--out", str(tmp_path)]) == 0
    before = outcomes_by_region(Request(tmp_path, told.append))
    assert OUTSIDE not in set(before.loc[before["kind"] == START, "region"])
    assert not told
    frame = outcomes_by_region(Request(tmp_path, told.append, named=True))
    around = frame[(frame["kind"] == START) & (frame["region"] == OUTSIDE)]
    assert around.groupby("cutout")["seed"].unique().map(sorted).to_dict() == {0.0: [0, 1], 0.4: [0]}
    assert ((around["x"] < 0.0) | (around["x"] > 1.0)).all()
    assert len(told) == 2
    pd.testing.assert_frame_equal(outcomes_by_region(Request(tmp_path, told.append, named=True)), frame)
    assert len(told) == 2


def test_what_was_played_stays_when_its_policy_is_gone(tmp_path: Path) -> None:
    assert main([*RUN, "--seeds", "2", "--out", str(tmp_path)]) == 0
    load_or_measure(tmp_path, PAIRS, print, measure_missing=True)
    (tmp_path / "toy_reach" / "toy_search" / "default" / "seed-00" / POLICY_FILE).unlink()
    assert main([*RUN, "--seeds", "3", "--out", str(tmp_path)]) == 0
    table = load_or_measure(tmp_path, PAIRS, print, measure_missing=True)
    assert table["seed"].value_counts().to_dict() == dict.fromkeys((0, 1, 2), INSTANCES)
