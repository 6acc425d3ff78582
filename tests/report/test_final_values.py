"""Final values of finished cells: means, intervals, strips and a verdict, by hand."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.cell.variant import Variant
from codesign_bench.report.cells import read_cells
from codesign_bench.report.final_values import STRIP_MARGIN, STRIP_WIDTH, estimate, strip, task_results, verdict
from codesign_bench.storage.frames import load_results
from codesign_bench.storage.records import FAILED
from reports import make_cell


def test_final_values_count_finished_cells_alone(tmp_path: Path) -> None:
    for seed, final in enumerate((1.0, 2.0, 6.0)):
        make_cell(tmp_path, seed, returns=(9.0, final))
    make_cell(tmp_path, 3, returns=(0.0, 100.0), status=FAILED)
    make_cell(tmp_path, 0, returns=(4.0,), variant=Variant.of(alpha=0.3))
    default, traded = task_results(read_cells(tmp_path)[0], load_results(tmp_path))
    (method,) = default.methods
    assert (default.variant, traded.variant) == ("default", "alpha-0.30")
    assert (method.seeds, method.unfinished, method.env_steps) == (3, 1, "0k")
    assert method.returns.values == (1.0, 2.0, 6.0)
    assert method.returns.mean == pytest.approx(3.0)
    assert method.successes.values == pytest.approx((0.1, 0.2, 0.6))
    assert default.return_axis == (1.0, 6.0)
    assert traded.methods[0].returns.text == "4.00"


def test_methods_with_different_budgets_are_ranked_with_a_caution(tmp_path: Path) -> None:
    for method, evaluations in (("gnn_ppo", 2), ("cma_es", 3)):
        for seed in range(3):
            make_cell(tmp_path, seed, returns=[1.0] * evaluations, method=method)
    (result,) = task_results(read_cells(tmp_path)[0], load_results(tmp_path))
    assert "different budgets" in result.verdict
    (alone,) = task_results(
        [cell for cell in read_cells(tmp_path)[0] if cell.method == "cma_es"], load_results(tmp_path)
    )
    assert "different budgets" not in alone.verdict


def test_an_estimate_has_an_interval_from_three_seeds_on() -> None:
    assert estimate([1.0, 3.0]).text == "2.00"
    assert not estimate([1.0, 3.0]).has_interval
    assert not estimate([2.0, 2.0, 2.0]).has_interval, "equal seeds have no spread to estimate"
    # Mean -2 and standard deviation 1: 4.303 / sqrt 3 on either side.
    assert estimate([-3.0, -2.0, -1.0]).text == "−2.00 [−4.48, 0.48]"  # noqa: RUF001


def test_marks_stand_where_the_values_are() -> None:
    drawn = strip(estimate([0.0, 0.5, 1.0]), (0.0, 1.0))
    assert drawn.dots == [STRIP_MARGIN, STRIP_WIDTH / 2.0, STRIP_WIDTH - STRIP_MARGIN]
    assert drawn.mean == STRIP_WIDTH / 2.0
    # The interval is wider than the axis and ends with it.
    assert (drawn.low, drawn.high) == (STRIP_MARGIN, STRIP_WIDTH - STRIP_MARGIN)
    narrow = strip(estimate([0.4, 0.5, 0.6]), (0.0, 1.0))
    assert STRIP_MARGIN < narrow.low < narrow.mean < narrow.high < STRIP_WIDTH - STRIP_MARGIN


def test_a_strip_without_width_puts_its_dots_in_the_middle() -> None:
    assert strip(estimate([2.0]), (2.0, 2.0)).dots == [STRIP_WIDTH / 2.0]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (
            {"A": [0.0, 1.0, 2.0], "B": [4.0, 5.0, 6.0], "C": [0.0, 0.0, 0.0]},
            "Highest final return: B, 5.00 [2.52, 7.48]; next: A, 1.00 [\N{MINUS SIGN}1.48, 3.48]. "
            "Difference: 4.00 [1.73, 6.27]; the first is higher in 100% of pairs of seeds. The first is ahead.",
        ),
        (
            {"A": [1.0, 1.0, 1.0], "B": [5.0, 5.0, 5.0]},
            "Highest final return: B, 5.00; next: A, 1.00. "
            "Seeds do not differ, so there is no interval: their spread is unknown.",
        ),
        (
            {"A": [4.0, 5.0, 6.0], "B": [4.0, 4.0, 4.0]},
            "Highest final return: A, 5.00 [2.52, 7.48]; next: B, 4.00. "
            "Difference: 1.00 [\N{MINUS SIGN}1.48, 3.48]; the first is higher in 83% of pairs of seeds. "
            "The interval contains 0: it may be chance.",
        ),
        (
            {"A": [5.0, 5.0], "B": [1.0, 1.0, 1.0]},
            "Highest final return: A, 5.00; next: B, 1.00. "
            "With fewer than 3 seeds there is no interval, and no ranking.",
        ),
        ({"A": [5.0, 6.0, 7.0]}, "Only one method: nothing to compare it with."),
    ],
)
def test_the_verdict_says_how_sure_the_order_is(values: dict[str, list[float]], expected: str) -> None:
    assert verdict([(label, estimate(numbers)) for label, numbers in values.items()]) == expected


def test_no_curves_give_no_final_values(tmp_path: Path) -> None:
    make_cell(tmp_path, 0)
    assert task_results(read_cells(tmp_path)[0], pd.DataFrame(columns=["task", "method", "variant", "seed"])) == []
