"""Tasks stand in figures as in listings, and rows of one task keep their order."""

from __future__ import annotations

import pandas as pd

from codesign_bench.paper_figs._order import in_task_order, task_order


def test_tasks_are_ordered_as_in_listings_with_unknown_ones_last_by_name() -> None:
    assert task_order(["weave", "scoop", "bend", "push", "scoop"]) == ["push", "scoop", "bend", "weave"]


def test_rows_follow_their_tasks_and_those_of_one_task_keep_their_order() -> None:
    frame = pd.DataFrame({"task": ["weave", "scoop", "push", "scoop"], "value": [1, 9, 3, 2]}, index=[7, 5, 3, 1])
    ordered = in_task_order(frame)
    assert ordered.to_dict("list") == {"task": ["push", "scoop", "scoop", "weave"], "value": [3, 9, 2, 1]}
    assert ordered.index.tolist() == [0, 1, 2, 3]
