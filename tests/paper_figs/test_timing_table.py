"""The table of times: its numbers by hand, as data, picture and text."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module
from codesign_bench.studies.corl2023.protocol import TIMINGS

figure: Any = load_module("paper_figs", "timing_table")


def cells() -> pd.DataFrame:
    """Return three cells: two of the paper's method on fetch cube, one of a method it does not know."""
    columns = ["task", "method", "label", "seed", "profile", "env_steps", "train_s", "cores", "cpu", "inference_s"]
    return pd.DataFrame(
        [
            ("fetch_cube", "gnn_ppo", "GNN-PPO", 0, "paper", 1_000_000, 400.0, 1, "A", 0.0005),
            ("fetch_cube", "gnn_ppo", "GNN-PPO", 1, "paper", 1_000_000, 500.0, 1, "A", np.nan),
            ("push", "mine_50%", "Mine 50%", 0, "quick", 100_000, 10.0, 2, "A", 0.001),
        ],
        columns=columns,
    )


def test_the_numbers_by_hand() -> None:
    push, fetch = figure.data(cells()).to_dict("records")
    assert (push["task"], push["cells"], push["cores"]) == ("push", 1, 2)
    # 10,000 steps/s: 10^7 steps take 1,000 s.
    assert push["training_minutes"] == pytest.approx(1_000.0 / 60.0)
    assert push["inference_ms"] == pytest.approx(1.0)
    assert np.isnan(push["paper_training_minutes"])
    # 2,500 and 2,000 steps/s: the median is 2,250.
    assert fetch["steps_per_second"] == pytest.approx(2_250.0)
    assert fetch["training_minutes"] == pytest.approx(1e7 / 2_250.0 / 60.0)
    assert fetch["paper_training_minutes"] == TIMINGS["gnn_ppo"].training_minutes
    assert fetch["paper_inference_ms"] == pytest.approx(1.68)


def test_the_texts_hold_every_row_and_escape_what_their_language_reads() -> None:
    texts = figure.texts(cells())
    assert "| push | Mine 50% | quick | 1 | 2 | 10,000 | 17 | 1.000 | - | - |" in texts["md"]
    assert r"push & Mine 50\% & quick & 1 & 2 & 10,000 & 17 & 1.000 & - & - \\" in texts["tex"]
    assert texts["tex"].count(r"\\") == 1 + 2


def test_the_picture_shows_every_row() -> None:
    (axes,) = figure.draw(cells()).axes
    (table,) = axes.tables
    shown = {cell.get_text().get_text() for cell in table.get_celld().values()}
    assert {"GNN-PPO", "Mine 50%", "2,250", "10,000", "212"} <= shown


def test_records_without_rows_or_columns_are_refused() -> None:
    with pytest.raises(UserError, match="have no rows"):
        figure.data(cells().iloc[:0])
    with pytest.raises(UserError, match="lack the column cpu"):
        figure.data(cells().drop(columns="cpu"))
