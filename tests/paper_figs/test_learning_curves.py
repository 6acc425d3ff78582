"""The learning-curve figure shows the numbers of the results, and says how many seeds stand behind them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.method import load_method, method_names
from codesign_bench.registry import load_module

learning_curves = load_module("paper_figs", "learning_curves")

STEPS = (0, 1000, 2000)


def cell(
    task: str,
    method: str,
    seed: int,
    returns: Sequence[float],
    *,
    steps: Sequence[int] = STEPS,
    variant: str = "default",
) -> pd.DataFrame:
    """Return one cell's curve as `load_results` would give it; it succeeds half as often as its return is high."""
    curve = {
        "env_steps": list(steps),
        "return_mean": list(returns),
        "success_rate": [value / 2 for value in returns],
        "wall_s": 1.0,
        "return_se": 0.0,
        "episode_length": 150.0,
        "cutout": 0.0,
        "alpha": math.nan,
    }
    return pd.DataFrame({**curve, "task": task, "method": method, "variant": variant, "seed": seed})


def three_seeds(task: str, method: str) -> pd.DataFrame:
    """Return three seeds with final returns 0.6, 0.8 and 1.0."""
    return pd.concat([cell(task, method, seed, [0.0, 0.4, 0.6 + 0.2 * seed]) for seed in range(3)])


def panel(figure: Figure, task: str) -> Axes:
    """Return the panel of a task's returns."""
    return next(axes for axes in figure.axes if axes.get_title() == task)


def line(axes: Axes, name: str) -> np.ndarray:
    """Return the line `name` of a panel as (points, 2) without gaps."""
    drawn = next(found for found in axes.lines if found.get_gid() == name)
    points = np.array(drawn.get_xydata(), dtype=np.float64)
    return points[~np.isnan(points[:, 1])]


def legend(figure: Figure) -> list[str]:
    """Return the entries of the figure's one legend."""
    (found,) = figure.legends
    return [text.get_text() for text in found.get_texts()]


def test_data_holds_mean_standard_error_and_seeds_of_both_quantities() -> None:
    table = learning_curves.data(three_seeds("push", "gnn_ppo"))
    final = table[table["env_steps"] == 2000].set_index("quantity")
    assert final.loc["return_mean", "mean"] == pytest.approx(0.8)
    assert final.loc["return_mean", "standard_error"] == pytest.approx(0.2 / math.sqrt(3))
    assert final.loc["success_rate", "mean"] == pytest.approx(0.4)
    assert set(table["seeds"]) == {3}


def test_the_line_is_the_mean_over_seeds() -> None:
    axes = panel(learning_curves.draw(three_seeds("push", "gnn_ppo")), "push")
    assert line(axes, "gnn_ppo") == pytest.approx(np.array([[0.0, 0.0], [1000.0, 0.4], [2000.0, 0.8]]))


def test_the_band_is_the_standard_error() -> None:
    axes = panel(learning_curves.draw(three_seeds("push", "gnn_ppo")), "push")
    (band,) = axes.collections
    heights = band.get_paths()[0].vertices
    at_end = np.asarray(heights)[np.isclose(np.asarray(heights)[:, 0], 2000.0), 1]
    assert at_end.min() == pytest.approx(0.8 - 0.2 / math.sqrt(3))
    assert at_end.max() == pytest.approx(0.8 + 0.2 / math.sqrt(3))


def test_one_panel_of_each_quantity_for_each_task() -> None:
    frame = pd.concat([three_seeds(task, "gnn_ppo") for task in ("scoop", "push", "catch_balls", "lift_cup")])
    figure = learning_curves.draw(frame)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    titles = [axes.get_title() for axes in shown if axes.get_title()]
    assert titles == ["push", "catch balls", "scoop", "lift cup"]
    assert [axes.get_ylabel() for axes in shown].count("success rate") == 4


def test_the_legend_counts_seeds_and_starts_with_the_papers_methods() -> None:
    third_party, own = three_seeds("push", "a_third_party"), three_seeds("push", "gnn_ppo")
    frame = pd.concat([third_party, cell("push", "cma_es", 0, [0, 0, 0]), own])
    assert legend(learning_curves.draw(frame)) == ["gnn_ppo (n=3)", "cma_es (n=1)", "a_third_party (n=3)"]


def test_the_legend_lies_within_the_figure_with_every_method_that_there_is() -> None:
    for methods in (method_names(), method_names()[:2]):
        cells = [three_seeds("push", name).assign(label=load_method(name).label) for name in methods]
        figure = learning_curves.draw(pd.concat(cells, ignore_index=True))
        place = figure.legends[0].get_window_extent()
        assert figure.bbox.x0 <= place.x0 < place.x1 <= figure.bbox.x1


def test_a_label_column_names_the_methods() -> None:
    frame = three_seeds("push", "gnn_ppo").assign(label="Graph network")
    assert legend(learning_curves.draw(frame)) == ["Graph network (n=3)"]


def test_the_kind_of_interval_is_written_on_the_figure() -> None:
    (found,) = learning_curves.draw(three_seeds("push", "gnn_ppo")).legends
    assert "standard error" in found.get_title().get_text()


@pytest.mark.parametrize("seeds", [1, 2])
def test_no_band_below_three_seeds(seeds: int) -> None:
    frame = pd.concat([cell("push", "gnn_ppo", seed, [0.0, 0.5, 1.0]) for seed in range(seeds)])
    axes = panel(learning_curves.draw(frame), "push")
    assert line(axes, "gnn_ppo")[-1].tolist() == [2000.0, 1.0]
    assert not axes.collections


def test_a_partial_sweep_is_dotted_where_seeds_are_missing() -> None:
    frame = pd.concat([three_seeds("push", "gnn_ppo"), cell("push", "gnn_ppo", 3, [0.0, 0.4], steps=STEPS[:2])])
    axes = panel(learning_curves.draw(frame), "push")
    assert line(axes, "gnn_ppo")[:, 0].tolist() == [0.0, 1000.0]
    assert line(axes, "gnn_ppo (fewer seeds)")[:, 0].tolist() == [1000.0, 2000.0]


def test_other_variants_are_left_out() -> None:
    frame = pd.concat([three_seeds("push", "gnn_ppo"), cell("scoop", "cma_es", 0, [9, 9, 9], variant="alpha-0.30")])
    table = learning_curves.data(frame)
    assert set(table["task"]) == {"push"}


def test_missing_columns_are_named() -> None:
    with pytest.raises(UserError, match="success_rate"):
        learning_curves.data(three_seeds("push", "gnn_ppo").drop(columns="success_rate"))


def test_results_without_a_default_cell_say_so() -> None:
    frame = cell("push", "gnn_ppo", 0, [0, 0, 0], variant="cutout-0.40")
    with pytest.raises(UserError, match="no evaluated cell of variant 'default'"):
        learning_curves.draw(frame)
    with pytest.raises(UserError, match="have no rows"):
        learning_curves.draw(frame.iloc[:0])


def test_reference_points_of_the_results_are_lines_and_a_file() -> None:
    frame = three_seeds("push", "gnn_ppo").assign(reference_script_return_mean=0.9, reference_script_success_rate=0.7)
    figure = learning_curves.draw(frame)
    (found,) = (line for line in panel(figure, "push").lines if line.get_gid() == "reference script")
    assert found.get_ydata() == pytest.approx([0.9, 0.9])
    assert legend(figure) == ["gnn_ppo (n=3)", "script"]
    assert learning_curves.texts(frame) == {
        "references.csv": "task,point,return_mean,success_rate\npush,script,0.9,0.7\n"
    }
    assert learning_curves.texts(three_seeds("push", "gnn_ppo")) == {}


def test_the_figure_can_be_saved(tmp_path: Path) -> None:
    figure = learning_curves.draw(three_seeds("push", "gnn_ppo"))
    for kind in ("png", "pdf"):
        figure.savefig(tmp_path / f"curves.{kind}")
        assert (tmp_path / f"curves.{kind}").stat().st_size > 1000
