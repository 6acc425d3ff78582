"""Hyperparameters that cannot be are named with what they could be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pytest

from codesign_bench.config.validation import check_choices, check_given, check_range


@dataclass(frozen=True)
class Settings:
    """Hyperparameters of every kind that is checked."""

    rate: float | None = 0.5
    widths: tuple[int, ...] = (8, 8)
    credit: Literal["joint", "separate"] = "joint"


@pytest.mark.parametrize("settings", [Settings(), Settings(rate=0.0), Settings(rate=1.0), Settings(rate=None)])
def test_the_ends_of_a_range_belong_to_it_and_none_is_no_number(settings: Settings) -> None:
    check_range(settings, 0.0, 1.0, "rate")


def test_a_number_out_of_range_is_named_with_the_range() -> None:
    with pytest.raises(ValueError, match=r"rate must be from 0 to 1, not 1\.5"):
        check_range(Settings(rate=1.5), 0.0, 1.0, "rate")
    with pytest.raises(ValueError, match=r"rate must be at least 0, not -0\.1"):
        check_range(Settings(rate=-0.1), 0.0, float("inf"), "rate")
    with pytest.raises(ValueError, match="rate must be"):
        check_range(Settings(rate=float("nan")), 0.0, float("inf"), "rate")


def test_every_number_of_a_tuple_counts() -> None:
    check_range(Settings(), 1, float("inf"), "widths")
    with pytest.raises(ValueError, match=r"widths must be at least 1, not \(8, 0\)"):
        check_range(Settings(widths=(8, 0)), 1, float("inf"), "widths")


def test_a_tuple_without_entries_is_named() -> None:
    check_given(Settings(), "widths")
    with pytest.raises(ValueError, match="widths must have at least one entry"):
        check_given(Settings(widths=()), "widths")


def test_a_choice_that_there_is_not_is_named_with_those_there_are() -> None:
    check_choices(Settings(credit="separate"))
    with pytest.raises(ValueError, match="credit must be one of 'joint', 'separate', not 'shared'"):
        check_choices(Settings(credit="shared"))  # type: ignore[arg-type]
