"""Figures as parts of the page."""

from __future__ import annotations

import base64

from reports import Reader


def test_figures_lie_in_the_page_with_their_numbers(page: str) -> None:
    pictures = [address for address in Reader(page).addresses if address.startswith("data:image/png;base64,")]
    assert len(pictures) == 4  # learning curves, as means and as interquartile means, final results, and times
    assert base64.b64decode(pictures[0].partition(",")[2]).startswith(b"\x89PNG")
    numbers, *_ = (address for address in Reader(page).addresses if address.startswith("data:text/csv;base64,"))
    table = base64.b64decode(numbers.partition(",")[2]).decode()
    assert table.startswith("task,method,quantity,env_steps,mean,standard_error,seeds\n")
    assert "reach,gnn_ppo,return_mean,100.0,3.0," in table


def test_figures_that_are_missing_are_named_with_the_reason(page: str) -> None:
    assert "design_sensitivity left out: not measured yet" in Reader(page).text
