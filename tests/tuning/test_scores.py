"""Scores: means over seeds of the last validation return; failed settings come last."""

from __future__ import annotations

from math import isnan, nan
from pathlib import Path

from builders import rising, store_cell
from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import Variant
from codesign_bench.storage.records import FAILED
from codesign_bench.tuning.scores import Score, best, score
from codesign_bench.tuning.settings import Setting

SETTING = Setting("push", "gnn_ppo", 3, {"epochs": 2})
VARIANT = Variant.of(rung=0, setting=3)
CELLS = [Cell("push", "gnn_ppo", seed, VARIANT, steps=500) for seed in (0, 1)]


def of(number: int, value: float) -> Score:
    """Return a score of the setting with a number."""
    return Score(Setting("push", "gnn_ppo", number, {}), 0, 500, 1000, value)


def test_a_score_is_the_mean_over_seeds_of_the_last_return(tmp_path: Path) -> None:
    store_cell(tmp_path, seed=0, variant=VARIANT, curve=rising(9.0, 2.0), env_steps=510)
    store_cell(tmp_path, seed=1, variant=VARIANT, curve=rising(9.0, 3.0), env_steps=520)
    found = score(SETTING, 0, CELLS, tmp_path)
    assert found == Score(SETTING, 0, 500, 1030, 2.5)


def test_a_failed_cell_leaves_no_score_but_its_steps_count(tmp_path: Path) -> None:
    store_cell(tmp_path, seed=0, variant=VARIANT, curve=rising(9.0, 2.0), env_steps=510)
    store_cell(tmp_path, seed=1, variant=VARIANT, curve=rising(9.0, 9.0), env_steps=100, status=FAILED)
    found = score(SETTING, 0, CELLS, tmp_path)
    assert isnan(found.validation_return)
    assert found.env_steps == 610


def test_a_cell_that_recorded_nothing_counts_as_failed(tmp_path: Path) -> None:
    found = score(SETTING, 0, CELLS, tmp_path)
    assert isnan(found.validation_return)
    assert found.env_steps == 0


def test_the_best_come_first_equal_ones_as_drawn_and_failed_ones_last() -> None:
    scores = [of(0, nan), of(1, -2.0), of(2, 5.0), of(3, 5.0), of(4, -1.0)]
    assert [found.setting.number for found in best(scores, 3)] == [2, 3, 4]
    assert [found.setting.number for found in best(scores, 5)] == [2, 3, 4, 1, 0]
