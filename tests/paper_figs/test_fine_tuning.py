"""The figure of fine-tuning: mean return over gradient steps, by hand."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "fine_tuning")

GIDS = ("finetune", "finetune (fewer seeds)")


def results(seeds: int = 3) -> pd.DataFrame:
    """Return curves of three gradient-step counts for two starts and both kinds, and a default cell."""
    rows = []
    for seed, start, (kind, slope) in product(range(seeds), (1, 2), (("finetune", 2.0), ("scratch", 1.0))):
        for point in range(3):
            value = slope * point + 0.5 * seed + 10.0 * (start - 1)
            axes = {"finetune": np.nan, "scratch": np.nan, kind: float(start)}
            steps = {"env_steps": 1_000 * point, "gradient_steps": 40 * point}
            outcome = {"return_mean": value, "success_rate": point / 2 if kind == "finetune" else 0.0}
            rows.append({"variant": f"{kind}-{start}", **axes, "seed": seed, **steps, **outcome})
    rows.append({"variant": "default", "seed": 0, "env_steps": 0, "gradient_steps": 0, "return_mean": 99.0})
    return pd.DataFrame(rows).assign(task="fetch_cube", method="gnn_ppo")


def test_the_numbers_by_hand() -> None:
    table = figure.data(results())
    assert set(table["start"]) == {1, 2}
    last = table[(table["start"] == 2) & (table["kind"] == "finetune") & (table["gradient_steps"] == 80)]
    row = last.set_index("quantity").loc["return_mean"]
    assert row["mean"] == pytest.approx(4.0 + 0.5 + 10.0)  # Seeds add 0, 0.5 and 1.
    assert row["standard_error"] == pytest.approx(0.5 / np.sqrt(3.0))
    assert row["seeds"] == 3
    assert 99.0 not in table["mean"].to_list()
    success = last.set_index("quantity").loc["success_rate"]
    assert (success["mean"], success["standard_error"], success["seeds"]) == (1.0, 0.0, 3)


def test_every_start_has_panels_with_both_kinds_and_no_band_below_three_seeds() -> None:
    drawn = figure.draw(results(seeds=2))
    panels = [axes for axes in drawn.axes if axes.get_visible()]
    assert [axes.get_title() for axes in panels] == ["fetch cube, start 1", "fetch cube, start 2", "", ""]
    assert [axes.get_ylabel() for axes in panels] == ["mean return", "", "success rate", ""]
    for axes in panels:
        seeds = {f"{kind} seed {seed}" for kind in ("finetune", "scratch") for seed in range(2)}
        assert {line.get_gid() for line in axes.lines} == {"finetune", "scratch"} | seeds
        assert not axes.collections
        np.testing.assert_array_equal(axes.lines[0].get_xdata(), [0, 40, 80])
    banded = figure.draw(results(seeds=3))
    assert all(len(axes.collections) == 2 for axes in banded.axes if axes.get_visible())
    (legend,) = banded.legends
    assert [text.get_text() for text in legend.get_texts()] == ["from the trained policy (n=3)", "from scratch (n=3)"]


def test_where_seeds_have_ended_the_line_is_dotted() -> None:
    frame = results()
    frame.loc[(frame["seed"] == 2) & (frame["env_steps"] == 2_000), "gradient_steps"] = 60  # Ends before the others.
    axes = figure.draw(frame).axes[0]
    solid, dotted = (next(line for line in axes.lines if line.get_gid() == gid) for gid in GIDS)
    assert np.isnan(solid.get_ydata()[-1])
    assert dotted.get_linestyle() == ":"
    assert dotted.get_xdata()[-1] == 80
    assert np.isfinite(dotted.get_ydata()[-1])


def test_results_without_such_cells_are_refused() -> None:
    frame = results()
    with pytest.raises(UserError, match="no cell of --finetune or --scratch"):
        figure.data(frame[frame["variant"] == "default"])
    with pytest.raises(UserError, match="gradient_steps"):
        figure.data(frame.drop(columns="gradient_steps"))
