"""What the user reads: numbers in words."""

from __future__ import annotations

from codesign_bench.console import duration, number


def test_durations_have_the_largest_unit_that_fits() -> None:
    assert [duration(seconds) for seconds in (42, 600, 12_600)] == ["42 s", "10 min", "3.5 h"]


def test_numbers_have_two_decimals_and_nothing_stands_for_none() -> None:
    assert [number(1.234), number(None)] == ["1.23", ""]
