"""Curves of methods on tasks: lines, bands, what is dotted or cut off, and a legend that counts seeds."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from codesign_bench.errors import UserError
from codesign_bench.paper_figs._curves import (
    QUANTITIES,
    REFERENCE_STYLES,
    draw_curve,
    draw_curves,
    draw_seeds,
    evaluated_rows,
    method_labels,
    reference_texts,
    seed_curves,
)
from codesign_bench.storage.reference_points import POINTS

STEPS = (0, 1000, 2000)


def curve(
    centre: Sequence[float], seeds: Sequence[int], steps: Sequence[float] = STEPS, width: float = math.nan
) -> pd.DataFrame:
    """Return one curve with a band of `width` on either side, reached by so many seeds at each step."""
    middle = np.asarray(centre, dtype=float)
    bounds = {"low": middle - width, "high": middle + width}
    return pd.DataFrame({"env_steps": steps, "centre": middle, **bounds, "seeds": seeds})


def both(task: str, method: str, seeds: int = 3) -> pd.DataFrame:
    """Return the rows of both quantities of a method on a task."""
    rows = curve((0.0, 0.4, 0.8), (seeds,) * 3)
    return pd.concat([rows.assign(task=task, method=method, quantity=name) for name in QUANTITIES])


def drawn(curve: pd.DataFrame) -> Axes:
    """Return the axes into which a curve named `ours` was drawn."""
    axes: Axes = Figure().subplots()
    draw_curve(axes, curve, "#0072B2", "-", gid="ours")
    return axes


def lines(axes: Axes) -> dict[str, list[list[float]]]:
    """Return the points of each line by its name, without gaps."""
    points = {str(line.get_gid()): np.array(line.get_xydata(), dtype=float) for line in axes.lines}
    return {name: found[~np.isnan(found[:, 1])].tolist() for name, found in points.items()}


def legend(figure: Figure) -> list[str]:
    """Return the entries of the figure's one legend."""
    (found,) = figure.legends
    return [text.get_text() for text in found.get_texts()]


def test_a_curve_is_a_line_and_a_band() -> None:
    axes = drawn(curve((0.0, 0.4, 0.8), (3, 3, 3), width=0.1))
    assert lines(axes) == {"ours": [[0.0, 0.0], [1000.0, 0.4], [2000.0, 0.8]]}
    (band,) = axes.collections
    corners = np.asarray(band.get_paths()[0].vertices)
    at_end = corners[np.isclose(corners[:, 0], 2000.0), 1]
    assert (at_end.min(), at_end.max()) == (pytest.approx(0.7), pytest.approx(0.9))


def test_a_curve_without_intervals_has_no_band() -> None:
    assert not drawn(curve((0.0, 0.4, 0.8), (2, 2, 2))).collections


def test_where_seeds_are_missing_the_line_is_dotted_from_the_solid_one_on() -> None:
    axes = drawn(curve((0.0, 0.4, 0.8), (4, 4, 3)))
    assert lines(axes) == {
        "ours": [[0.0, 0.0], [1000.0, 0.4]],
        "ours (fewer seeds)": [[1000.0, 0.4], [2000.0, 0.8]],
    }


def test_seeds_that_end_a_few_steps_apart_make_no_spike() -> None:
    # Two seeds end 4 and 9 steps after the first: less than a twentieth of the curve, too short to see.
    axes = drawn(curve((0.0, 0.0, 1.0, 1.5, 2.0), (3, 3, 3, 2, 1), steps=(0, 1000, 2000, 2004, 2009)))
    assert lines(axes) == {"ours": [[0.0, 0.0], [1000.0, 0.0], [2000.0, 1.0]]}


def test_a_start_that_some_seeds_lack_is_cut_off_alike() -> None:
    axes = drawn(curve((5.0, 0.0, 1.0), (1, 3, 3), steps=(0, 10, 2000)))
    assert lines(axes) == {"ours": [[10.0, 0.0], [2000.0, 1.0]]}


def test_every_task_has_a_panel_of_returns_above_one_of_success_rates() -> None:
    tasks = ("scoop", "push", "catch_balls", "lift_cup")
    figure = draw_curves(pd.concat([both(task, "gnn_ppo") for task in tasks]), {}, "bands: none")
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in shown if axes.get_title()] == ["push", "catch balls", "scoop", "lift cup"]
    above, below = (
        next(axes for axes in shown if axes.get_ylabel() == quantity) for quantity in ("mean return", "success rate")
    )
    assert above.get_position().y0 > below.get_position().y1
    assert len(shown) == 8


def levels(task: str, **returns: float) -> pd.DataFrame:
    """Return reference points of a task; success is a tenth of the return."""
    rows = [{"point": name, "return_mean": value, "success_rate": value / 10.0} for name, value in returns.items()]
    return pd.DataFrame(rows).assign(task=task)


def test_reference_points_are_thin_lines_in_the_panels_of_their_task_and_named_once() -> None:
    table = pd.concat([both("push", "gnn_ppo"), both("scoop", "gnn_ppo")])
    points = pd.concat([levels("push", idle=-1.0, best_known=2.0), levels("scoop", idle=-3.0)])
    figure = draw_curves(table, {}, "", points)
    drawn = {
        (axes.get_ylabel(), line.get_gid(), line.get_ydata()[0])
        for axes in figure.axes
        for line in axes.lines
        if str(line.get_gid()).startswith("reference ")
    }
    assert drawn == {
        ("mean return", "reference idle", -1.0),
        ("mean return", "reference best_known", 2.0),
        ("mean return", "reference idle", -3.0),
        ("success rate", "reference idle", -0.1),
        ("success rate", "reference best_known", 0.2),
        ("success rate", "reference idle", -0.3),
    }
    assert legend(figure) == ["gnn_ppo (n=3)", "idle", "best known"]
    thin = [line for axes in figure.axes for line in axes.lines if str(line.get_gid()).startswith("reference ")]
    thick = [line for axes in figure.axes for line in axes.lines if line.get_gid() == "gnn_ppo"]
    assert max(line.get_linewidth() for line in thin) < min(line.get_linewidth() for line in thick)


def test_without_reference_points_a_figure_says_nothing_of_them() -> None:
    assert legend(draw_curves(both("push", "gnn_ppo"), {}, "", levels("push").reindex(columns=["task", "point"]))) == [
        "gnn_ppo (n=3)"
    ]
    assert reference_texts(both("push", "gnn_ppo")) == {}


def test_every_reference_point_has_a_line_of_its_own() -> None:
    assert tuple(REFERENCE_STYLES) == POINTS
    assert len(set(REFERENCE_STYLES.values())) == len(POINTS)


def test_the_legend_counts_seeds_in_the_order_of_methods() -> None:
    table = pd.concat([both("push", "mine"), both("push", "cma_es", seeds=1), both("push", "gnn_ppo")])
    figure = draw_curves(table, {"mine": "My own"}, "bands: standard error")
    assert legend(figure) == ["gnn_ppo (n=3)", "cma_es (n=1)", "My own (n=3)"]
    assert figure.legends[0].get_title().get_text() == "bands: standard error"


def test_the_legend_gives_the_range_of_seeds_over_tasks() -> None:
    table = pd.concat([both("push", "gnn_ppo"), both("scoop", "gnn_ppo", seeds=1)])
    assert legend(draw_curves(table, {}, "")) == ["gnn_ppo (n=1-3)"]


def test_every_seed_is_a_thin_line_of_its_own() -> None:
    points = {"env_steps": [0, 10, 0, 10], "return_mean": [0.0, 1.0, 0.0, 3.0], "success_rate": [0.0, 0.1, 0.0, 0.3]}
    rows = pd.DataFrame({**points, "seed": [0, 0, 4, 4]}).assign(task="push", method="gnn_ppo", variant="default")
    seeds = seed_curves(rows)
    assert set(seeds["quantity"]) == set(QUANTITIES)
    axes: Axes = Figure().subplots()
    draw_seeds(axes, seeds[seeds["quantity"] == "return_mean"], "#0072B2", gid="ours")
    assert lines(axes) == {"ours seed 0": [[0.0, 0.0], [10.0, 1.0]], "ours seed 4": [[0.0, 0.0], [10.0, 3.0]]}


def test_labels_are_those_of_the_frame_where_it_has_any() -> None:
    frame = pd.DataFrame({"method": ["a", "a", "b"], "label": ["A", "A", None]})
    assert method_labels(frame) == {"a": "A"}
    assert method_labels(frame.drop(columns="label")) == {}


def test_evaluated_rows_of_the_default_variant_are_drawn() -> None:
    rows = {"env_steps": [0, 10, 0], "task": "push", "method": "a", "variant": ["default", "default", "alpha-0.30"]}
    frame = pd.DataFrame({**rows, "seed": 0, "return_mean": [1.0, math.nan, 2.0], "success_rate": 0.0})
    assert evaluated_rows(frame)["return_mean"].tolist() == [1.0]
    with pytest.raises(UserError, match="no evaluated cell of variant 'default'"):
        evaluated_rows(frame[1:])
    with pytest.raises(UserError, match="lack the columns env_steps, seed"):
        evaluated_rows(frame.drop(columns=["env_steps", "seed"]))
