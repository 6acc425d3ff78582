"""Instances inside of cutout regions: where they lie, and that every policy is played on them once."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.evaluation.cutout_regions import (
    COLUMNS,
    INSTANCES,
    load_cutout_regions,
    measure_cutout_regions,
    region_instances,
)
from codesign_bench.storage.layout import POLICY_FILE
from codesign_bench.task import load_task

RUN = ("run", "--method", "toy_search", "--task", "toy_reach", "--steps", "60", "--set", "evaluations=1")


@pytest.mark.parametrize("fraction", [0.1, 0.9])
def test_instances_lie_in_the_region_and_are_always_the_same(fraction: float) -> None:
    task = load_task("fetch_cube")
    instances = region_instances(task, fraction)
    assert instances.shape == (INSTANCES, task.instance_space.size)
    assert task.in_cutout(instances, fraction).all()
    assert task.in_region(instances).all()
    assert (instances == region_instances(task, fraction)).all()


def test_tasks_without_positions_have_no_regions() -> None:
    with pytest.raises(UserError, match="positions"):
        region_instances(load_task("scoop"), 0.4)


@pytest.mark.usefixtures("toy")
def test_policies_are_played_once_on_the_regions_that_they_are_compared_on(tmp_path: Path) -> None:
    told: list[str] = []
    assert main([*RUN, "--seeds", "2", "--out", str(tmp_path)]) == 0
    assert main([*RUN, "--seeds", "1", "--cutout", "0.4", "--out", str(tmp_path)]) == 0
    with pytest.raises(UserError, match="--measure"):
        load_cutout_regions(tmp_path)
    measure_cutout_regions(tmp_path, "toy_reach", "toy_search", (0.2, 0.4), told.append)
    first = load_cutout_regions(tmp_path)
    assert tuple(first.columns) == COLUMNS
    counts = first.groupby(["region", "cutout", "seed"]).size().to_dict()
    played = [(0.2, 0.0, 0), (0.2, 0.0, 1), (0.4, 0.0, 0), (0.4, 0.0, 1), (0.4, 0.4, 0)]
    assert counts == dict.fromkeys(played, INSTANCES)
    assert first["success"].isin([0, 1]).all()
    count = len(told)
    # A policy that is gone stays in the table, and nothing is played again.
    (tmp_path / "toy_reach" / "toy_search" / "default" / "seed-00" / POLICY_FILE).unlink()
    measure_cutout_regions(tmp_path, "toy_reach", "toy_search", (0.2, 0.4), told.append)
    assert len(told) == count
    assert load_cutout_regions(tmp_path).equals(first)
