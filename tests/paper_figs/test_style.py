"""A method looks the same in every figure, and any two look different."""

from __future__ import annotations

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from codesign_bench.paper_figs._style import COLOURS, SETTINGS, draw_table, in_order, line_styles, style


def test_methods_stand_in_the_order_of_listings_and_compared_results_last() -> None:
    names = ["mine", "cma_es from before", "cma_es", "another", "gnn_ppo"]
    assert in_order(names) == ["gnn_ppo", "cma_es", "another", "mine", "cma_es from before"]


def test_the_papers_methods_keep_their_colours_in_any_company() -> None:
    alone, together = line_styles(["cma_rl"]), line_styles(["gnn_ppo", "x", "cma_rl"])
    assert alone["cma_rl"] == together["cma_rl"] == (COLOURS["cma_rl"], "-")


@pytest.mark.parametrize("count", [3, 9])
def test_other_methods_can_be_told_apart(count: int) -> None:
    styles = line_styles([f"method_{index}" for index in range(count)])
    assert len(set(styles.values())) == count
    assert not {colour for colour, _ in styles.values()} & set(COLOURS.values())


def test_compared_results_are_dashed_in_their_methods_colour() -> None:
    styles = line_styles(["gnn_ppo", "gnn_ppo from before", "mine from before"])
    assert set(styles) == {"gnn_ppo", "gnn_ppo from before", "mine from before"}
    assert styles["gnn_ppo from before"] == (styles["gnn_ppo"][0], "--")
    assert styles["mine from before"][1] == "--"


def test_figures_do_not_depend_on_the_users_settings_and_leave_them_alone() -> None:
    with mpl.rc_context({"font.size": 33, "lines.linestyle": ":"}):
        with style():
            assert mpl.rcParams["font.size"] == SETTINGS["font.size"]
            assert mpl.rcParams["lines.linestyle"] == "-"
        assert mpl.rcParams["font.size"] == 33


def test_a_table_holds_header_and_rows_as_text() -> None:
    axes = Figure().subplots()
    draw_table(axes, ["task", "n"], [["push", "6"], ["scoop", "3"]])
    (table,) = axes.tables
    cells = {place: cell.get_text().get_text() for place, cell in table.get_celld().items()}
    assert cells == {(0, 0): "task", (0, 1): "n", (1, 0): "push", (1, 1): "6", (2, 0): "scoop", (2, 1): "3"}
    assert not axes.axison
