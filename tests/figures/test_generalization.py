"""Regions of positions: trained on, cut out, and beyond; and which evaluations belong to which."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from builders import store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.figures.generalization import outcomes_by_region, regions
from codesign_bench.figures.source import Request
from codesign_bench.task import load_task


def finish(out: Path, task: str, cutout: float | None, seed: int = 0) -> None:
    """Write a finished cell whose every evaluation returned its seed."""
    entries, instances = load_task(task).instance_space, load_task(task).evaluation_instances()
    rows = [
        {
            **{f"instance_{name}": value for name, value in zip(entries.names, instance, strict=True)},
            "return": float(seed),
            "success": 1,
        }
        for instance in instances
    ]
    store_cell(out, task=task, seed=seed, variant=Variant.of(cutout=cutout), evaluation=rows)


def test_the_papers_patches_lie_in_its_training_region() -> None:
    places = np.array([[0.2, 0.65], [0.0, 0.65], [0.39, 0.65], [0.5, 0.65]])
    found = regions(load_task("fetch_cube"), places, 0.6)
    assert found.tolist() == ["cutout", "training", "training", "outside"]


def test_with_nothing_cut_out_all_is_training_region() -> None:
    task = load_task("push")
    assert set(regions(task, task.evaluation_instances(), 0.0)) == {"training"}
    middle = np.array([[16.0, 8.25]])  # the puck's start, which the ring of goals surrounds
    assert regions(task, middle, 0.0).tolist() == ["outside"]


@pytest.mark.parametrize("name", ["push", "catch_balls", "fetch_cube"])
def test_the_fraction_is_the_share_of_the_training_region(name: str) -> None:
    task = load_task(name)
    instances = task.sample_instances(np.random.default_rng(0), 20_000)
    assert (regions(task, instances, 0.4) == "cutout").mean() == pytest.approx(0.4, abs=0.02)


def test_evaluations_stand_in_their_regions_beside_a_grid_of_places(tmp_path: Path) -> None:
    finish(tmp_path, "fetch_cube", 0.6)
    finish(tmp_path, "fetch_cube", None, seed=1)
    finish(tmp_path, "push", None)
    frame = outcomes_by_region(Request(tmp_path, print))
    assert set(frame["task"]) == {"fetch_cube"}  # Nothing was cut out of push.
    starts = frame[frame["kind"] == "start"]
    assert starts.groupby("cutout")["seed"].unique().map(list).to_dict() == {0.0: [1], 0.6: [0]}
    assert set(starts.loc[starts["cutout"] == 0.0, "region"]) == {"training"}
    unseen = starts[(starts["cutout"] == 0.6) & (starts["region"] == "cutout")]
    assert unseen["x"].abs().between(0.045, 0.351).all()  # the paper's patches
    assert unseen["x_label"].unique().tolist() == ["cube start x (m)"]
    places = frame[(frame["kind"] == "place") & (frame["cutout"] == 0.6)]
    area = places["region"].value_counts()
    assert area["cutout"] / (area["cutout"] + area["training"]) == pytest.approx(0.6, abs=0.02)
    assert places["x"].min() < -0.395 < 0.395 < places["x"].max()
    compared = frame[frame["kind"] == "compared"]
    assert compared[["cutout", "seed", "region"]].drop_duplicates().to_numpy().tolist() == [[0.6, 1, "cutout"]]
    assert compared["instance"].tolist() == unseen["instance"].tolist()


def test_positions_of_one_entry_have_no_y(tmp_path: Path) -> None:
    finish(tmp_path, "catch_balls", 0.4)
    frame = outcomes_by_region(Request(tmp_path, print))
    assert frame["y"].isna().all()
    assert set(frame["y_label"]) == {""}


def test_results_without_a_cutout_say_so(tmp_path: Path) -> None:
    finish(tmp_path, "push", None)
    with pytest.raises(UserError, match="no finished cell with a cutout"):
        outcomes_by_region(Request(tmp_path, print))
