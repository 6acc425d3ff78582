"""The figure of headroom: its numbers by hand, its picture with everything that it names."""

from __future__ import annotations

from math import nan
from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "headroom")


def measured(
    returns: list[float], *, task: str = "push", method: str = "gnn_ppo", seed: int = 0, known: float = nan
) -> pd.DataFrame:
    """Return rows of a cell: the designer earns `returns` on its instances, the best 1 more, others less."""
    rows = [
        {
            **{"task": task, "method": method, "variant": "default", "seed": seed, "label": method.upper()},
            **{"instance": instance, "env_steps": 100, "known_return": known, "known_success": 1.0},
            **{"designer_return": earned, "best_return": earned + 1, "other_return": earned, "random_return": 0.0},
            **{"designer_success": 0, "best_success": 1, "other_success": 0, "random_success": 0.25},
        }
        for instance, earned in enumerate(returns)
    ]
    return pd.DataFrame(rows)


def test_the_numbers_by_hand() -> None:
    frame = pd.concat([measured([1.0, 3.0], seed=seed, known=5.0 + seed) for seed in (0, 1)])
    table = figure.data(frame).set_index("tool")
    assert table.index.tolist() == ["designer", "best", "other", "random"]
    assert table["return"].tolist() == [2.0, 3.0, 2.0, 0.0]
    assert table["success"].tolist() == [0.0, 1.0, 0.0, 0.25]
    assert set(table["known_return"]) == {5.5}
    assert set(table["seeds"]) == set(table["instances"]) == {2}
    assert set(table["env_steps"]) == {200.0}
    assert table["return_low"].isna().all(), "two seeds have no interval"


def test_three_seeds_have_an_interval() -> None:
    frame = pd.concat([measured([value], seed=seed) for seed, value in enumerate((1.0, 2.0, 3.0))])
    row = figure.data(frame).set_index("tool").loc["designer"]
    # 2 +- 4.303 / sqrt(3): the 97.5 % point of Student's t with two degrees of freedom.
    assert (row["return_low"], row["return_high"]) == (pytest.approx(2 - 2.4842, abs=1e-3), pytest.approx(4.4842, 1e-3))
    assert row["success_low"] != row["success_low"], "all seeds are equal"


def test_methods_are_compared_on_the_instances_that_all_of_them_have() -> None:
    frame = pd.concat([measured([1.0, 9.0]), measured([2.0], method="cma_rl")])
    table = figure.data(frame)
    assert table.loc[table["tool"] == "designer", ["method", "return", "instances"]].values.tolist() == [
        *(["gnn_ppo", 1.0, 1], ["cma_rl", 2.0, 1]),
    ]
    elsewhere = measured([2.0], method="cma_rl").assign(instance=7)
    with pytest.raises(UserError, match="cells of push have no measured instance in common"):
        figure.data(pd.concat([measured([1.0]), elsewhere]))


def test_what_is_not_known_of_all_instances_is_not_averaged() -> None:
    frame = measured([1.0, 2.0], known=3.0)
    frame.loc[1, "known_return"] = nan
    assert figure.data(frame)["known_return"].isna().all()


def test_every_tool_of_every_method_is_drawn_and_the_best_known() -> None:
    frame = pd.concat([measured([1.0], known=4.0), measured([2.0], method="cma_rl"), measured([3.0], task="scoop")])
    drawn = figure.draw(frame)
    assert [axes.get_title(loc="left") for axes in drawn.axes[::2]] == ["push, 1 instances", "scoop, 1 instances"]
    lines = {line.get_gid(): line.get_xdata() for line in drawn.axes[0].lines}
    for method, earned in (("gnn_ppo", 1.0), ("cma_rl", 2.0)):
        for tool, shift in (("designer", 0.0), ("best", 1.0), ("other", 0.0)):
            assert lines[f"{method} {tool}"] == [earned + shift]
        assert lines[f"{method} random"] == [0.0]
    assert list(lines["best known"]) == [4.0, 4.0]
    assert "best known" not in {line.get_gid() for line in drawn.axes[2].lines}, "no return is known of scoop"
    (legend,) = drawn.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        *(text for _, _, text in figure.MARKS.values()),
        "best known",
    ]


def test_other_variants_are_left_out() -> None:
    with pytest.raises(UserError, match="no headroom of variant 'default'"):
        figure.draw(measured([1.0]).assign(variant="alpha-0.30"))
    with pytest.raises(UserError, match="lack the column best_return"):
        figure.draw(measured([1.0]).drop(columns="best_return"))
