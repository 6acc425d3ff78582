"""Scores: means over seeds of the last validation return; failed settings come last."""

from __future__ import annotations

from math import isnan, nan
from pathlib import Path

from builders import rising, store_cell
from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import Variant
from codesign_bench.storage.records import FAILED
from codesign_bench.tuning.scores import Score, best, confirmed, pooled, score, survivors
from codesign_bench.tuning.settings import Setting

SETTING = Setting("push", "gnn_ppo", 3, {"epochs": 2})
VARIANT = Variant.of(rung=0, setting=3)
CELLS = [Cell("push", "gnn_ppo", seed, VARIANT, steps=500) for seed in (0, 1)]


def of(number: int, value: float, method: str = "gnn_ppo", task: str = "push") -> Score:
    """Return a score of the setting with a number."""
    return Score(Setting(task, method, number, {}), 0, 500, 1000, value)


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


def test_as_many_go_on_for_every_method_on_every_task_but_failed_ones() -> None:
    scores = [
        *(of(number, value) for number, value in enumerate((1.0, 3.0, 2.0))),
        *(of(number, value, "cma_es") for number, value in enumerate((-5.0, nan, -4.0))),
        *(of(number, nan, "cma_rl") for number in range(3)),
    ]
    going_on = [(found.setting.method, found.setting.number) for found in survivors(scores, 2)]
    assert going_on == [("gnn_ppo", 1), ("gnn_ppo", 2), ("cma_es", 0), ("cma_es", 2)]


def test_a_pooled_choice_is_the_best_mean_rank_over_tasks_whatever_their_scales() -> None:
    returns = {"push": (0.1, 0.2, 0.3), "scoop": (500.0, 900.0, 100.0), "bounce": (-3.0, -1.0, -2.0)}
    scores = [of(number, value, task=task) for task, values in returns.items() for number, value in enumerate(values)]
    # Mean ranks: (3 + 2 + 3) / 3, (2 + 1 + 1) / 3 and (1 + 3 + 2) / 3.
    assert [(found.setting.task, found.setting.number) for found in pooled(scores, 1)] == [(t, 1) for t in returns]
    assert {found.setting.number for found in pooled(scores, 2)} == {1, 2}


def test_a_pooled_choice_prefers_the_first_of_equals_and_no_setting_that_failed_somewhere() -> None:
    scores = [
        *(of(number, value) for number, value in enumerate((1.0, 2.0, 9.0))),
        *(of(number, value, task="scoop") for number, value in enumerate((2.0, 1.0, nan))),
        *(of(number, value, "cma_es") for number, value in enumerate((0.0, 0.0, 0.0))),
    ]
    going_on = [(found.setting.method, found.setting.task, found.setting.number) for found in pooled(scores, 1)]
    assert going_on == [("gnn_ppo", "push", 0), ("gnn_ppo", "scoop", 0), ("cma_es", "push", 0)]


def test_a_change_replaces_the_present_settings_only_where_it_is_ahead_on_enough_tasks() -> None:
    returns = {
        "gnn_ppo": {"push": (1.0, 2.0), "scoop": (1.0, 2.0), "bounce": (1.0, 0.0)},  # ahead on two tasks
        "cma_es": {"push": (1.0, 2.0), "scoop": (1.0, 1.0), "bounce": (1.0, 1.0)},  # equal is not ahead
    }
    scores = [
        of(number, value, method, task)
        for method, of_method in returns.items()
        for task, values in of_method.items()
        for number, value in enumerate(values)
    ]
    winners = [found for found in scores if found.setting.number == 1]

    def chosen(ahead_on: int) -> dict[tuple[str, str], int]:
        found = confirmed(winners, scores, ahead_on)
        return {(of_one.setting.method, of_one.setting.task): of_one.setting.number for of_one in found}

    def numbers(of_gnn: int, of_cma: int) -> dict[tuple[str, str], int]:
        number = {"gnn_ppo": of_gnn, "cma_es": of_cma}
        return {(method, task): number[method] for method in returns for task in returns[method]}

    assert chosen(1) == numbers(1, 1)
    assert chosen(2) == numbers(1, 0)
    assert chosen(3) == numbers(0, 0)


def test_present_settings_that_failed_are_replaced_by_the_best_change() -> None:
    scores = [of(0, nan), of(1, -5.0), of(0, 3.0, task="scoop"), of(1, 2.0, task="scoop")]
    assert [found.setting.number for found in confirmed([scores[1], scores[3]], scores, 2)] == [1, 1]
