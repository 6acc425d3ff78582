"""The figure of generalisation: its numbers by hand, every start on its map, no interval below three seeds."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "generalization")

POSITIONS = {0: (-0.2, 0.6, "cutout"), 1: (0.0, 0.6, "training"), 2: (0.1, 0.6, "training")}
"""Three starts: one that is never trained on, two that are."""


def evaluations(cutout: float, seeds: int, *, task: str = "fetch_cube", flat: bool = False) -> pd.DataFrame:
    """Return evaluations where training starts return 10, cutout starts the seed; seed 0 alone solves these."""
    rows = []
    for seed in range(seeds):
        for instance, (x, y, region) in POSITIONS.items():
            seen = region == "training"
            values = {"return": 10.0 if seen else float(seed), "success": int(seen or seed == 0)}
            place = {"x": x, "y": np.nan if flat else y, "x_label": "start x (m)", "y_label": "start y (m)"}
            cell = {"task": task, "method": "gnn_ppo", "label": "GNN-PPO", "cutout": cutout, "seed": seed}
            rows.append({**cell, **values, **place, "kind": "start", "region": region, "instance": instance})
    return pd.DataFrame(rows)


def places(cutout: float, *, flat: bool = False) -> pd.DataFrame:
    """Return a grid where the left half of -0.4..0.4 is cut out and all beyond is outside."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.5, 0.5, 11), np.linspace(0.3, 0.9, 7)))
    region = np.where(np.abs(x) > 0.45, "outside", np.where(x < 0.0, "cutout", "training"))
    known = {"task": "fetch_cube", "cutout": cutout, "kind": "place", "region": region}
    return pd.DataFrame({**known, "x": x, "y": np.nan if flat else y})


def bars(axes: Axes) -> dict[str, ErrorbarContainer]:
    """Return the lines of returns by region."""
    return {str(bar.get_label()): bar for bar in axes.containers if isinstance(bar, ErrorbarContainer)}


def test_the_numbers_by_hand() -> None:
    table = figure.data(evaluations(0.4, seeds=3)).set_index("region")
    assert table.loc["cutout", "return_mean"] == pytest.approx(1.0)
    assert table.loc["cutout", "standard_error"] == pytest.approx(1.0 / np.sqrt(3))
    assert table.loc["cutout", "success_rate"] == pytest.approx(1 / 3)
    assert table.loc["training", ["return_mean", "starts", "seeds"]].tolist() == [10.0, 2, 3]


def test_no_interval_below_three_seeds() -> None:
    assert figure.data(evaluations(0.4, seeds=2))["standard_error"].isna().all()


def test_the_map_shows_every_start_of_the_fraction_nearest_to_the_papers() -> None:
    frame = pd.concat([evaluations(0.2, 3), evaluations(0.8, 2), places(0.2), places(0.8)])
    left, *_ = figure.draw(frame).axes
    assert left.get_title() == "fetch cube, GNN-PPO: 80% cut out (n=2)"
    (starts,) = [found for found in left.collections if found.get_gid() == "starts"]
    assert np.asarray(starts.get_offsets()).tolist() == [[-0.2, 0.6], [0.0, 0.6], [0.1, 0.6]]
    assert np.asarray(starts.get_array()).tolist() == [0.5, 1.0, 1.0]


def test_the_borders_of_both_regions_are_drawn() -> None:
    left, *_ = figure.draw(pd.concat([evaluations(0.6, 3), places(0.6)])).axes
    borders = [found for found in left.collections if found.get_gid() != "starts"]
    assert len(borders) == 2
    cutout = np.concatenate([path.vertices for path in borders[1].get_paths()])
    assert cutout[:, 0].min() == pytest.approx(-0.45)
    assert cutout[:, 0].max() == pytest.approx(-0.05)  # half way between the last place inside and the first outside


def test_the_right_panel_shows_the_returns_of_each_region() -> None:
    _, right, *_ = figure.draw(pd.concat([evaluations(0.6, 3), evaluations(0.2, 3), places(0.6)])).axes
    drawn = bars(right)
    assert set(drawn) == {"training", "cutout"}
    line = drawn["cutout"].lines[0]
    assert np.asarray(line.get_xdata()).tolist() == [0.2, 0.6]
    assert np.asarray(line.get_ydata()).tolist() == [1.0, 1.0]
    assert right.get_title() == "n=3"


def test_starts_outside_the_training_region_have_a_line_of_their_own() -> None:
    frame = evaluations(0.6, 3)
    frame.loc[frame["instance"] == 2, "region"] = "outside"
    drawn = figure.draw(pd.concat([frame, places(0.6)]))
    assert "outside" in bars(drawn.axes[1])
    (legend,) = drawn.legends
    assert len(legend.get_texts()) == 3


def test_policies_that_saw_everything_are_a_line_over_the_same_fractions() -> None:
    seen = evaluations(0.6, 3).query("region == 'cutout'").assign(**{"kind": "compared", "return": 4.0})
    frame = pd.concat([evaluations(0.6, 3), places(0.6), seen])
    assert figure.data(frame).set_index("region").loc["seen", ["return_mean", "seeds", "starts"]].tolist() == [
        4.0,
        3,
        1,
    ]
    left, right, *_ = figure.draw(frame).axes
    assert np.asarray(bars(right)["seen"].lines[0].get_ydata()).tolist() == [4.0]
    (starts,) = [found for found in left.collections if found.get_gid() == "starts"]
    assert len(starts.get_offsets()) == 3, "the map has only what was trained without the region"


def test_positions_on_a_line_are_drawn_over_the_share_of_seeds() -> None:
    left, *_ = figure.draw(pd.concat([evaluations(0.6, 3, flat=True), places(0.6, flat=True)])).axes
    (starts,) = [found for found in left.collections if found.get_gid() == "starts"]
    assert np.asarray(starts.get_offsets())[:, 1].tolist() == pytest.approx([1 / 3, 1.0, 1.0])


def test_the_numbers_of_the_map_are_a_table_of_their_own() -> None:
    table = pd.read_csv(io.StringIO(figure.texts(pd.concat([evaluations(0.6, 2), places(0.6)]))["map.csv"]))
    assert table["solved"].tolist() == [0.5, 1.0, 1.0]
    assert table["region"].tolist() == ["cutout", "training", "training"]


def test_every_task_has_its_row() -> None:
    frame = pd.concat([evaluations(0.6, 1), evaluations(0.6, 1, task="push"), places(0.6)])
    titles = [axes.get_title() for axes in figure.draw(frame).axes if "cut out" in axes.get_title()]
    assert [title.split(",")[0] for title in titles] == ["push", "fetch cube"]


def test_what_is_missing_is_named() -> None:
    with pytest.raises(UserError, match="have no rows"):
        figure.data(places(0.6).reindex(columns=figure.NEEDED).assign(kind="place"))
    with pytest.raises(UserError, match="lack the column region"):
        figure.draw(evaluations(0.6, 3).drop(columns="region"))
