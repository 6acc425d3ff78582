"""Numbers and lists as the page writes them."""

from __future__ import annotations

import math

import pytest

from codesign_bench.report.tables import NOTHING, listed, number


@pytest.mark.parametrize(
    ("value", "text"), [(1.234, "1.23"), (-0.5, "\N{MINUS SIGN}0.50"), (0.0, "0.00"), (math.nan, NOTHING)]
)
def test_numbers_have_two_decimals_a_true_minus_and_a_dash_for_none(value: float, text: str) -> None:
    assert number(value) == text


def test_a_long_list_is_cut_and_says_how_much_more_there_is() -> None:
    assert listed(["a", "b"]) == "a, b"
    assert listed(["a", "b", "c", "d"]) == "a, b, c, d"
    assert listed(["a", "b", "c", "d", "e", "f"]) == "a, b, c, d and 2 more"
    assert listed(["a", "b", "c"], most=1) == "a and 2 more"
    assert listed([]) == ""
