"""Comparing: differences that can be checked by hand, with their tests, of what both results have."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from builders import rising, store_cell, store_table
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.sharing.compare import common_scales, compare, notes, rows_of
from codesign_bench.stats import Reference, holm, welch
from codesign_bench.storage.measurements import REFERENCE_POINTS

ENDS = {"a": (2.0, 2.1, 2.2), "b": (1.0, 1.1, 1.2)}


@pytest.fixture
def two(tmp_path: Path) -> tuple[Path, Path]:
    """Return two folders with three seeds of a method on two tasks; one has another task, one another version."""
    for name, ends in ENDS.items():
        for task in ("push", "scoop"):
            for seed, end in enumerate(ends):
                end = end if task == "push" else 1.0 + 0.1 * seed
                store_cell(tmp_path / name, task=task, seed=seed, curve=rising(0.0, end), env_steps=100)
        points = [
            {"task": task, "point": point, "return_mean": value}
            for task in ("push", "scoop")
            for point, value in (("idle", 0.0), ("best_known", 4.0 if name == "a" else 5.0))
        ]
        store_table(tmp_path / name / "reference_points.csv", REFERENCE_POINTS, *points)
    store_cell(tmp_path / "a", task="lift_cup", method="cma_es")
    store_cell(tmp_path / "b", task="lift_cup", method="cma_es", task_version=2)
    return tmp_path / "a", tmp_path / "b"


def test_differences_have_intervals_and_adjusted_p_values(two: tuple[Path, Path]) -> None:
    found = compare(*two)
    push, scoop = found.differences
    # 2.1 - 1.1, each with a standard deviation of 0.1: 1 -+ 2.776 * 0.1 * sqrt(2 / 3).
    assert push.returns.value == pytest.approx(1.0)
    assert push.returns.low == pytest.approx(1.0 - 2.7764 * 0.1 * math.sqrt(2 / 3), rel=1e-4)
    assert push.scores.value == pytest.approx(1.0 / 5.0), "the higher best known of the two is the scale"
    assert scoop.returns.value == pytest.approx(0.0)
    assert scoop.returns.p == pytest.approx(1.0)
    assert push.p == welch(*ENDS.values()).p
    assert [push.p_adjusted, scoop.p_adjusted] == holm([push.p, scoop.p]).tolist()
    (average,) = found.averages
    assert average.scores.value == pytest.approx(0.1)
    assert (average.family_size, push.family_size) == (1, 2)


def test_the_table_and_the_lines_below_it(two: tuple[Path, Path]) -> None:
    found = compare(*two)
    first, _, average = rows_of(found)
    assert first[:6] == ("push", "gnn_ppo", "3, 3", "2.10", "1.10", "+1.00 [+0.77, +1.23]")
    assert first[-1].endswith("(2)")
    assert average[0] == "average of 2 tasks"
    lines = notes(found)
    assert lines[0].startswith(f"A is {two[0]}, B is {two[1]}")
    assert "only in A: cma_es on lift_cup (version 1)" in lines
    assert "only in B: cma_es on lift_cup (version 2)" in lines
    assert lines[-1] == "commits: not recorded (all 14 cells)"


def test_other_budgets_are_told(two: tuple[Path, Path]) -> None:
    for name, folder in zip(("a", "b"), two, strict=True):
        store_cell(folder, task="fetch_cube", env_steps={"a": 100, "b": 300}[name])
    assert "budgets differ on fetch_cube, gnn_ppo: 100 and 300 environment steps" in notes(compare(*two))


def test_two_methods_are_compared_by_their_names(two: tuple[Path, Path]) -> None:
    for seed in range(3):
        store_cell(two[1], method="cma_es", seed=seed, curve=rising(0.0, 0.1 * seed))
    (found,) = compare(*two, methods=["gnn_ppo", "cma_es"]).differences
    assert found.methods == ("gnn_ppo", "cma_es")
    assert found.returns.value == pytest.approx(2.0)
    assert rows_of(compare(*two, methods=["gnn_ppo", "cma_es"]))[0][1] == "gnn_ppo - cma_es"
    assert compare(*two, methods=["gnn_ppo"]).alone == []


def test_variants_are_compared_on_demand(two: tuple[Path, Path]) -> None:
    for folder in two:
        store_cell(folder, variant=Variant.of(cutout=0.4))
    assert len(compare(*two).differences) == 2
    found = compare(*two, variants=True).differences
    assert [difference.place for difference in found] == ["push cutout-0.40", "push", "scoop"]
    assert math.isnan(found[0].p), "a single seed has no test"


def test_nothing_in_common_is_an_error_that_says_what_there_is(two: tuple[Path, Path], tmp_path: Path) -> None:
    store_cell(tmp_path / "c", method="cma_rl")
    with pytest.raises(UserError, match=r"has cma_rl on push \(version 1\)"):
        compare(two[0], tmp_path / "c")
    with pytest.raises(UserError, match=r"has cma_rl on push \(version 1\)"):
        compare(tmp_path / "c", tmp_path / "c", methods=["no_such_method"])
    with pytest.raises(UserError, match="--method"):
        compare(*two, methods=["a", "b", "c"])


def test_the_scale_goes_to_the_higher_best_known() -> None:
    first, second = (
        {("push", 1): Reference(0.0, 2.0)},
        {("push", 1): Reference(0.0, 3.0), ("scoop", 1): Reference(1, 2)},
    )
    both = common_scales(first, second)
    assert both == {("push", 1): Reference(0.0, 3.0), ("scoop", 1): Reference(1, 2)}
    assert common_scales(second, first) == both
