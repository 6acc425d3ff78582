"""Every kind of interval that is printed holds the truth as often as docs/statistics.md says."""

from __future__ import annotations

import math

import pytest
from interval_coverage import ROWS, SEEDS, SIMULATED, coverage, of_difference, of_interquartile_mean, of_share, read

pytestmark = pytest.mark.numeric

AGAIN, OF_BOOTSTRAPS = 600, 150
"""Data sets that are simulated here; a bootstrap takes longer."""


def test_the_page_has_every_interval() -> None:
    assert set(read()) == {(title, name) for title, name, _ in ROWS}


@pytest.mark.parametrize("row", range(len(ROWS)), ids=[f"{title}, {name}" for title, name, _ in ROWS])
def test_the_page_says_how_often_an_interval_holds_the_truth(row: int) -> None:
    title, name, kind = ROWS[row]
    again = OF_BOOTSTRAPS if kind is of_interquartile_mean else AGAIN
    for n, told in zip(SEEDS, read()[title, name], strict=True):
        found, without = coverage(row, n, again, seed=1)
        simulated = again * (1.0 - without)
        spread = max(told * (1.0 - told), 0.002) * (1.0 / simulated + 1.0 / SIMULATED)
        assert found == pytest.approx(told, abs=4.0 * math.sqrt(spread)), f"n = {n}"


def test_intervals_that_decide_about_methods_hold_what_they_promise() -> None:
    pages = read()
    for title, name, kind in ROWS:
        if kind in (of_difference, of_share):
            assert min(pages[title, name]) >= 0.94


def test_the_page_says_where_intervals_fall_short() -> None:
    short = {title for (title, _), numbers in read().items() if min(numbers) < 0.93}
    assert short == {"mean of one method, t", "interquartile mean over three tasks, bootstrap"}
