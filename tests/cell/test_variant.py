"""A variant is a value; its name is derived from it, and nothing derives it from a name."""

from __future__ import annotations

import pytest

from codesign_bench.cell.variant import DEFAULT, Variant, in_axis_order


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({}, "default"),
        ({"cutout": 0.4}, "cutout-0.40"),
        ({"alpha": 0.0}, "alpha-0.00"),
        ({"alpha": 0.125}, "alpha-0.125"),
        ({"alpha": 0.3, "cutout": 0.4}, "cutout-0.40_alpha-0.30"),
        ({"finetune": 1}, "finetune-1"),
        ({"scratch": None, "finetune": 12}, "finetune-12"),
        ({"credit": "joint", "budget": 3, "alpha": 1.0}, "alpha-1.00_budget-3_credit-joint"),
    ],
)
def test_the_name_follows_from_the_values(values: dict[str, float | int | str | None], name: str) -> None:
    assert Variant.of(**values).name == name


def test_variants_are_equal_by_their_values_whatever_the_order() -> None:
    assert Variant.of(alpha=0.3, cutout=0.4) == Variant.of(cutout=0.4, alpha=0.3)
    assert len({Variant.of(alpha=0.3), Variant.of(alpha=0.3), DEFAULT}) == 2


def test_axes_are_read_changed_and_left_out() -> None:
    variant = Variant.of(cutout=0.4, finetune=2)
    assert (variant.get("cutout"), variant.get("alpha")) == (0.4, None)
    assert variant.without("finetune") == Variant.of(cutout=0.4)
    assert variant.with_(finetune=None, alpha=0.3) == Variant.of(cutout=0.4, alpha=0.3)
    assert dict(variant) == {"cutout": 0.4, "finetune": 2}


def test_a_variant_travels_as_json() -> None:
    variant = Variant.of(cutout=0.4, credit="joint")
    assert Variant.from_json(variant.to_json()) == variant
    assert Variant.from_json({"alpha": None}) == DEFAULT
    with pytest.raises(TypeError, match="axis 'alpha' is a list"):
        Variant.from_json({"alpha": [0.3]})  # type: ignore[dict-item]


def test_axes_of_the_paper_come_first() -> None:
    assert in_axis_order({"credit", "scratch", "beta", "cutout"}) == ["cutout", "scratch", "beta", "credit"]
