"""The figure of the study `credit`: the last evaluation of every seed, by hand."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "design_credit")


def curve(credit: str, seed: int, last: float, *, method: str = "gnn_ppo", task: str = "push") -> pd.DataFrame:
    """Return a curve that starts at 0 and ends at the return `last`, with half of it as success."""
    variant = f"credit-{credit}"
    rows = [
        (task, method, method.upper(), variant, credit, seed, steps, value, 0.5 * value)
        for steps, value in ((100, last), (0, 0.0))
    ]
    columns = ["task", "method", "label", "variant", "credit", "seed", "env_steps", "return_mean", "success_rate"]
    return pd.DataFrame(rows, columns=columns)


FRAME = pd.concat(
    [
        curve("separate", 0, 0.4),
        curve("joint", 1, 0.8),
        curve("joint", 0, 0.6),
        curve("joint", 0, 0.2, method="shared_arch"),
    ]
)


def test_the_last_evaluation_of_each_seed_counts_in_the_order_of_tasks_methods_and_credits() -> None:
    table = figure.data(FRAME)
    assert list(zip(table["method"], table["credit"], table["seed"], table["return_mean"], strict=True)) == [
        ("gnn_ppo", "joint", 0, 0.6),
        ("gnn_ppo", "joint", 1, 0.8),
        ("gnn_ppo", "separate", 0, 0.4),
        ("shared_arch", "joint", 0, 0.2),
    ]
    assert set(table["env_steps"]) == {100}


def test_a_credit_that_a_label_names_is_not_named_twice() -> None:
    frame = curve("joint", 0, 1.0).assign(label="GNN-PPO, joint credit")
    assert set(figure.data(frame)["label"]) == {"GNN-PPO, joint credit"}


def test_cells_without_a_credit_do_not_count() -> None:
    default = curve("joint", 5, 9.0).assign(variant="default", credit=None)
    assert figure.data(pd.concat([FRAME, default]))["seed"].tolist() == [0, 1, 0, 0]
    with pytest.raises(UserError, match="no cell with a credit"):
        figure.data(default)
    with pytest.raises(UserError, match="credit"):
        figure.data(default.drop(columns="credit"))


def test_every_seed_is_a_dot_and_every_mean_a_bar() -> None:
    (panel,) = [axes for axes in figure.draw(FRAME).axes if axes.get_visible()]
    drawn = [line.get_ydata().tolist() for line in panel.lines]
    assert drawn == [[0.6, 0.8], [pytest.approx(0.7)] * 2, [0.4], [0.4, 0.4], [0.2], [0.2, 0.2]]
    assert [label.get_text() for label in panel.get_xticklabels()] == [
        "GNN_PPO\njoint credit",
        "GNN_PPO\nseparate credit",
        "SHARED_ARCH\njoint credit",
    ]


def test_the_table_gives_every_seed() -> None:
    text = figure.texts(FRAME)["md"]
    assert "| push | GNN_PPO, joint credit | 2 | 100 | 0.70 | 0.60, 0.80 | 0.35 |" in text
