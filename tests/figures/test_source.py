"""Where figures get their numbers."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from builders import rising, store_cell, store_table
from codesign_bench.errors import UserError
from codesign_bench.figures.source import (
    Request,
    curves,
    curves_with_references,
    design_sensitivity,
    design_values,
    evaluations,
    final_curves,
    headroom,
    tasks_in,
    tasks_shown,
    timing,
    trials_on_an_arm,
)
from codesign_bench.storage.layout import ARCHIVE_FILE
from codesign_bench.storage.measurements import DEPLOYMENT, DESIGN_SENSITIVITY, REFERENCE_POINTS
from codesign_bench.storage.records import RUNNING
from codesign_bench.storage.reference_points import FILE, reference_points_in


def test_curves_are_those_of_all_cells_and_evaluations_those_of_finished_ones(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(0.0, 1.0), evaluation=[{"return": 1.0}, {"return": 3.0}])
    store_cell(tmp_path, seed=1, status=RUNNING, curve=rising(0.0, 5.0), evaluation=[{"return": 9.0}])
    assert curves(Request(tmp_path))["return_mean"].tolist() == [0.0, 1.0, 0.0, 5.0]
    assert final_curves(Request(tmp_path))["return_mean"].tolist() == [0.0, 1.0]
    assert evaluations(Request(tmp_path))["return"].tolist() == [1.0, 3.0]


def test_nothing_is_final_where_no_cell_is_finished(tmp_path: Path) -> None:
    store_cell(tmp_path, status=RUNNING, curve=rising(0.0, 5.0))
    with pytest.raises(UserError, match=r"no finished cell in .* create some with: codesign-bench run --method"):
        final_curves(Request(tmp_path))


def test_an_archive_is_never_measured_whatever_was_named(tmp_path: Path) -> None:
    assert Request(tmp_path, named=True).may_measure
    assert not Request(tmp_path).may_measure
    (tmp_path / ARCHIVE_FILE).write_text("{}")
    assert not Request(tmp_path, named=True).may_measure
    with pytest.raises(UserError, match="not measured yet"):
        design_sensitivity(Request(tmp_path, named=True))


def test_curves_come_with_the_reference_points_that_the_folder_has(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(0.0, 1.0))
    pd.testing.assert_frame_equal(curves_with_references(Request(tmp_path)), curves(Request(tmp_path)))
    row = {"task": ["push"], "point": ["script"], "return_mean": [1.5], "success_rate": [0.5]}
    store_table(tmp_path / FILE, REFERENCE_POINTS, {name: value for name, (value,) in row.items()})
    found = reference_points_in(curves_with_references(Request(tmp_path)))
    assert found.to_dict("list") == row


def test_tasks_are_those_of_the_cells_each_once(tmp_path: Path) -> None:
    for task, seed in (("scoop", 0), ("push", 0), ("push", 1)):
        store_cell(tmp_path, task=task, seed=seed, status=RUNNING)
    assert sorted(tasks_in(tmp_path)) == ["push", "scoop"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="give the figure's name to draw it without cells"):
        tasks_in(tmp_path / "empty")


def test_trials_are_read_from_beside_the_cells(tmp_path: Path) -> None:
    for task in ("lift_cup", "fetch_cube"):
        store_table(tmp_path / "deployment" / task / "protocol.csv", DEPLOYMENT, {"task": task})
    assert trials_on_an_arm(Request(tmp_path))["task"].tolist() == ["fetch_cube", "lift_cup"]


def test_what_was_measured_is_read_and_nothing_is_measured_for_a_figure_that_nobody_named(tmp_path: Path) -> None:
    told: list[str] = []
    with pytest.raises(UserError, match="measure it with: codesign-bench plot design_sensitivity"):
        design_sensitivity(Request(tmp_path, told.append))
    assert (told, list(tmp_path.iterdir())) == ([], [])
    store_table(tmp_path / "design_sensitivity" / "push.csv", DESIGN_SENSITIVITY, {"task": "push", "return": 2.0})
    assert design_sensitivity(Request(tmp_path))["return"].tolist() == [2.0]


def test_a_named_figure_of_tasks_shows_those_of_the_study_and_those_with_cells(tmp_path: Path) -> None:
    named = Request(tmp_path / "runs", named=True, tasks=("scoop", "push"))
    assert tasks_shown(named) == ["push", "scoop"], "there need be no folder"
    store_cell(tmp_path / "runs", task="bounce")
    assert tasks_shown(named) == ["push", "scoop", "bounce"]
    assert tasks_shown(Request(tmp_path / "runs", tasks=("scoop", "push"))) == ["bounce"]


@pytest.mark.parametrize(
    "source",
    [
        curves,
        curves_with_references,
        evaluations,
        design_sensitivity,
        design_values,
        headroom,
        timing,
        trials_on_an_arm,
    ],
)
def test_a_source_without_data_says_how_to_make_some(source: object, tmp_path: Path) -> None:
    assert callable(source)
    with pytest.raises(UserError, match="codesign-bench "):
        source(Request(tmp_path))
