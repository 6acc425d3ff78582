"""The size of a search: rungs, budgets and steps, which are the same for every method."""

from __future__ import annotations

from typing import Any

import pytest

from codesign_bench.registry import names
from codesign_bench.seeding import TUNING_SEEDS
from codesign_bench.study import DEFAULT_STUDY, FIRST_REPORTED_SEED, Tuning, load_study, study_names
from codesign_bench.tuning.settings import settings_of


def tuning(**changes: Any) -> Tuning:
    return Tuning(**{"methods": ("a", "b"), "tasks": ("t",), "settings": 18, **changes})


def test_one_setting_in_three_goes_on_to_three_times_the_budget() -> None:
    assert tuning().sizes == [18, 6, 2]
    assert tuning().budgets(900) == [100, 300, 900]
    assert tuning(settings=5, rungs=2, eta=2).sizes == [5, 2]
    assert tuning(rungs=1).budgets(900) == [900]


def test_steps_are_those_of_all_cells_of_a_method_on_a_task() -> None:
    assert tuning().steps([100, 300, 900]) == 2 * (18 * 100 + 6 * 300 + 2 * 900)
    assert tuning(seeds=(4,)).steps([100, 300, 900]) == 5400


def test_a_search_may_play_a_share_of_the_budget() -> None:
    assert tuning(share=0.5).budgets(900) == [50, 150, 450]
    assert tuning(share=0.25, rungs=1, settings=4).budgets(1_000_000) == [250_000]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"rungs": 0}, "at least 1 rung"),
        ({"eta": 1}, "at least 1 rung and eta 2, not 3 and 1"),
        ({"settings": 8}, "8 settings are too few for 3 rungs with eta 3"),
        ({"share": 0.0}, "above 0 and at most 1, not 0.0 and None"),
        ({"spread": 1.5}, "above 0 and at most 1, not 1.0 and 1.5"),
        ({"ahead_on": 2, "spread": 0.5}, "needs a pooled search around the present settings"),
        ({"ahead_on": 2, "pooled": True}, "needs a pooled search around the present settings"),
        ({"seeds": ()}, r"different ones from 0 to 9, not \(\)"),
        ({"seeds": (0, 0)}, "different ones from 0 to 9"),
        ({"seeds": (FIRST_REPORTED_SEED,)}, r"from 0 to 9, not \(100,\)"),
    ],
)
def test_a_search_that_cannot_be_is_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        tuning(**changes)


def test_reported_seeds_are_beyond_those_of_tuning() -> None:
    assert max(TUNING_SEEDS) < FIRST_REPORTED_SEED


@pytest.mark.parametrize("name", study_names())
def test_a_study_searches_the_settings_of_all_of_its_methods(name: str) -> None:
    study = load_study(name)
    if study.tuning is None:
        pytest.skip("does without")
    assert set(study.methods) <= set(study.tuning.methods)
    assert set(study.tuning.tasks) <= set(names("tasks"))
    for method in study.tuning.methods:
        assert settings_of(study.tuning, study.tuning.tasks[0], method, "laptop")


@pytest.mark.parametrize("name", study_names())
def test_a_study_that_tunes_reports_other_seeds(name: str) -> None:
    study = load_study(name)
    if study.tuning is None or name == DEFAULT_STUDY:  # whose shipped cells are older than its search
        pytest.skip("does without")
    seeds = {
        seed
        for experiment in study.experiments.values()
        for stage in experiment.stages
        for grid in stage
        for seed in (grid.seeds if isinstance(grid.seeds, tuple) else sum(grid.seeds.values(), ()))
    }
    assert min(seeds, default=FIRST_REPORTED_SEED) >= FIRST_REPORTED_SEED
