"""Results are read as one tidy frame whose rows carry everything that identifies their cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import rising, store_cell, store_table, sweep, toy_cells
from codesign_bench import load_results
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.storage.frames import LeftOutWarning, default_rows, load_evaluations, require_columns, rows_varying
from codesign_bench.storage.layout import CURVE_COLUMNS
from codesign_bench.storage.measurements import REFERENCE_POINTS
from codesign_bench.storage.records import RUNNING
from codesign_bench.storage.reference_points import FILE

VARIANTS = [{}, {"cutout": 0.4}, {"alpha": 0.125}, {"alpha": 1.0}, {"cutout": 0.4, "alpha": 0.3}, {"finetune": 1}]


def test_each_row_identifies_its_cell(tmp_path: Path) -> None:
    store_cell(tmp_path, method="one", curve=rising(1.0, 2.0, 3.0))
    store_cell(tmp_path, method="two", seed=4, variant=Variant.of(cutout=0.4), curve=rising(0.0, 1.0), label="Second")
    frame = load_results(tmp_path)
    axes = ["cutout", "alpha", "finetune", "scratch"]
    assert list(frame.columns) == [
        "task",
        "method",
        "variant",
        *axes,
        "seed",
        "label",
        *CURVE_COLUMNS,
        "normalized_score",
    ]
    assert frame["method"].tolist() == ["one"] * 3 + ["two"] * 2
    assert frame["label"].tolist() == ["one"] * 3 + ["Second"] * 2
    assert frame["variant"].tolist() == ["default"] * 3 + ["cutout-0.40"] * 2
    assert frame["seed"].tolist() == [0, 0, 0, 4, 4]
    assert frame["env_steps"].tolist() == [0, 100, 200, 0, 100]
    assert frame["cutout"].isna().tolist() == [True] * 3 + [False] * 2
    assert frame["alpha"].isna().all()


def points(out: Path, version: int = 1) -> None:
    """Write reference points of push: idling earns -1, the best known 3."""
    ends = {"idle": -1.0, "best_known": 3.0}
    rows = [{"task": "push", "task_version": version, "point": name, "return_mean": end} for name, end in ends.items()]
    store_table(out / FILE, REFERENCE_POINTS, *rows)


def test_returns_come_with_their_place_between_idling_and_the_best_known(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(-1.0, 1.0, 5.0), evaluation=[{"return": 3.0}, {"return": 7.0}])
    store_cell(tmp_path, task="scoop", curve=rising(1.0))
    store_cell(tmp_path, variant=Variant.of(cutout=0.4), curve=rising(2.0))
    store_cell(tmp_path, variant=Variant.of(alpha=0.3), curve=rising(2.0))
    store_cell(tmp_path, variant=Variant.of(somebodys=1), curve=rising(2.0))
    assert load_results(tmp_path)["normalized_score"].isna().all(), "no points were measured"
    points(tmp_path)
    frame = load_results(tmp_path).set_index(["task", "variant"])["normalized_score"]
    assert frame.loc["push", "default"].tolist() == [0.0, 0.5, 1.5]
    assert frame.loc[[("push", "cutout-0.40")]].tolist() == [0.75], "judged on the same instances"
    others = frame.drop([("push", "default"), ("push", "cutout-0.40")])
    assert len(others) == 3
    assert others.isna().all(), "without points, with another reward, of an axis that is not known here"
    evaluations = load_evaluations(tmp_path)
    own = evaluations[(evaluations["task"] == "push") & (evaluations["variant"] == "default")]
    assert own["normalized_score"].tolist() == [1.0, 2.0]


def test_points_of_another_version_of_a_scene_give_no_score(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(1.0), task_version=2)
    points(tmp_path, version=1)
    assert load_results(tmp_path)["normalized_score"].isna().all()
    points(tmp_path, version=2)
    assert load_results(tmp_path)["normalized_score"].tolist() == [0.5]


def test_an_axis_that_a_study_added_is_a_column_of_every_row(tmp_path: Path) -> None:
    store_cell(tmp_path, curve=rising(1.0))
    store_cell(tmp_path, variant=Variant.of(credit="joint", alpha=0.3), curve=rising(2.0))
    frame = load_results(tmp_path)
    assert list(frame.columns[:9]) == [
        *("task", "method", "variant", "cutout", "alpha", "finetune", "scratch", "credit", "seed"),
    ]
    assert frame.set_index("variant")["credit"].fillna("-").to_dict() == {
        "default": "-",
        "alpha-0.30_credit-joint": "joint",
    }


def test_partial_sweeps_and_foreign_files_do_not_matter(tmp_path: Path) -> None:
    store_cell(tmp_path, seed=0, curve=rising(1.0, 2.0))
    store_cell(tmp_path, seed=1, status=RUNNING)
    (store_cell(tmp_path, seed=2, curve=rising(1.0)) / "curve.csv").unlink()
    (store_cell(tmp_path, seed=3, curve=rising(1.0)) / "curve.csv").write_text("somebody,else\n1,2\n")
    (store_cell(tmp_path, seed=4, curve=rising(1.0)) / "cell.json").write_text("{")
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.warns(LeftOutWarning) as told:
        assert load_results(str(tmp_path))["seed"].unique().tolist() == [0]
    named = ("seed-02/curve.csv", "seed-03/curve.csv", "seed-04/cell.json")
    assert all(any(name in str(warning.message) for warning in told) for name in named)
    assert len(told) == len(named)


def test_a_missing_or_empty_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nowhere"):
        load_results(tmp_path / "nowhere")
    with pytest.raises(UserError, match="no results"):
        load_results(tmp_path)


@pytest.mark.usefixtures("toy")
def test_evaluations_hold_every_instance_of_every_finished_cell(tmp_path: Path) -> None:
    sweep(toy_cells(2, variants=[Variant.of(cutout=0.5)], steps=100), tmp_path)
    frame = load_evaluations(tmp_path)
    assert len(frame) == 2 * 8
    assert frame.groupby("seed")["instance"].apply(list).tolist() == [list(range(8))] * 2
    assert frame["cutout"].eq(0.5).all()
    assert (frame["in_cutout"] == (frame["instance_goal"] < 0.5)).all()
    with pytest.raises(UserError, match="no finished cell"):
        load_evaluations(tmp_path / "toy_reach")


@pytest.fixture
def varied(tmp_path: Path) -> pd.DataFrame:
    """One row for each of `VARIANTS`."""
    for values in VARIANTS:
        store_cell(tmp_path, variant=Variant.of(**values), curve=rising(1.0))  # type: ignore[arg-type]
    return load_results(tmp_path)


def test_rows_are_chosen_by_what_they_vary_and_nothing_else(varied: pd.DataFrame) -> None:
    assert default_rows(varied)["variant"].tolist() == ["default"]
    assert rows_varying(varied, "alpha")["alpha"].tolist() == [0.125, 1.0]
    assert rows_varying(varied, "cutout")["variant"].tolist() == ["cutout-0.40"]
    assert rows_varying(varied, "finetune")["variant"].tolist() == ["finetune-1"]
    assert rows_varying(varied, "scratch").empty


def test_columns_that_are_missing_are_named() -> None:
    frame = pd.DataFrame({"a": [1.0, np.nan]})
    require_columns(frame, ["a"], "the rows")
    with pytest.raises(UserError, match="the rows lack the columns b, c"):
        require_columns(frame, ["a", "b", "c"], "the rows")
    with pytest.raises(UserError, match="the rows have no rows"):
        require_columns(frame.iloc[:0], ["a"], "the rows")
