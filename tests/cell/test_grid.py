"""Grids: every combination of values, and the seeds that `--seeds` means."""

from __future__ import annotations

import pytest

from codesign_bench.cell.cell import Cell
from codesign_bench.cell.grid import grid, parse_seeds, variants_of
from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.errors import UserError


def test_a_grid_has_every_combination_and_every_method_of_a_seed_first() -> None:
    variants = variants_of({"cutout": [0.4, 0.125], "alpha": [0.3]})
    found = list(grid(tasks=["push"], methods=["a", "b"], seeds=[0, 12], variants=variants))
    assert len(found) == 8
    assert {cell.name for cell in found if cell.method == "a"} == {
        f"push/a/cutout-{cutout}_alpha-0.30/seed-{seed}" for cutout in ("0.40", "0.125") for seed in ("00", "12")
    }
    assert [cell.method for cell in found[:2]] == ["a", "b"]
    assert Cell.from_json(found[0].to_json()) == found[0]


def test_axes_that_exclude_each_other_come_one_after_the_other() -> None:
    assert variants_of({"finetune": [1, 2], "scratch": [1], "alpha": []}) == [
        Variant.of(finetune=1),
        Variant.of(finetune=2),
        Variant.of(scratch=1),
    ]
    assert variants_of({}) == [DEFAULT]


def test_a_value_has_the_kind_of_its_axis_and_counts_once() -> None:
    assert [variant.name for variant in variants_of({"alpha": [1, 1.0]})] == ["alpha-1.00"]


@pytest.mark.parametrize(
    ("text", "seeds"), [("3", (0, 1, 2)), ("0,3,5", (0, 3, 5)), ("2-4", (2, 3, 4)), ("1,4-5,4", (1, 4, 5))]
)
def test_seeds(text: str, seeds: tuple[int, ...]) -> None:
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize("text", ["0", "-1", "-3,2", "two", "4-2", "", "1,,2", "1.5"])
def test_bad_seeds(text: str) -> None:
    with pytest.raises(UserError, match="--seeds"):
        parse_seeds(text)
