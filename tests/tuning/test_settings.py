"""Settings of a search: as many for every method, drawn alike, each with its cells."""

from __future__ import annotations

from dataclasses import replace

import pytest

import toy
from codesign_bench import plugins
from codesign_bench.cell.cell import resolve_cell, resolve_cells
from codesign_bench.errors import UserError
from codesign_bench.seeding import TUNING_SEEDS
from codesign_bench.study import Tuning, load_study
from codesign_bench.tuning.settings import Setting, cells_in_turn, settings_of


@pytest.fixture
def tuning(toy: None) -> Tuning:
    """The search of the toy study."""
    plugins.import_modules(["toy_tuning"])
    found = load_study("toy_tuning").tuning
    assert found is not None
    return replace(found, seeds=(0, 1))


def test_every_method_gets_as_many_settings_and_none_is_the_shipped_one(tuning: Tuning) -> None:
    aim, search = (settings_of(tuning, "toy_reach", method, "quick") for method in tuning.methods)
    assert [setting.number for setting in aim] == [setting.number for setting in search] == [0, 1, 2]
    assert [list(setting.values) for setting in search] == [["episodes", "step_size"]] * 3
    assert all(setting.values["length"] != 0.5 for setting in aim)


def test_a_setting_that_two_methods_share_is_drawn_alike() -> None:
    study = Tuning(methods=("gnn_ppo", "shared_arch"), tasks=("push",), settings=9)
    drawn = [[setting.values for setting in settings_of(study, "push", name, "laptop")] for name in study.methods]
    assert drawn[0] == drawn[1]
    assert drawn[0] == [setting.values for setting in settings_of(study, "scoop", "gnn_ppo", "laptop")]


def test_a_search_around_the_profile_begins_with_its_settings_and_stays_near_them(tuning: Tuning) -> None:
    study = Tuning(methods=("gnn_ppo",), tasks=("push",), settings=30, spread=0.2)
    shipped, *others = settings_of(study, "push", "gnn_ppo", "laptop")
    assert (shipped.number, shipped.overrides) == (0, ())
    assert [setting.number for setting in others] == list(range(1, 30))
    rates = [setting.values["policy_learning_rate"] for setting in others]
    # A fifth of the logarithms from 3e-5 to 3e-3 is a factor of 10^0.4; the profile's rate is 7e-4.
    assert 7e-4 * 10**-0.2 <= min(rates) < 7e-4 < max(rates) <= 7e-4 * 10**0.2


def test_a_change_is_the_same_on_every_task() -> None:
    study = Tuning(methods=("gnn_ppo",), tasks=("push", "scoop"), settings=9, spread=0.5)
    push, scoop = (settings_of(study, task, "gnn_ppo", "laptop")[1].values for task in study.tasks)
    assert push["clip_ratio"] == scoop["clip_ratio"]
    shift = {name: values["control_log_std"] for name, values in (("push", push), ("scoop", scoop))}
    assert shift["push"] - -0.5 == pytest.approx(shift["scoop"] - -1.0, abs=1e-3)


def test_its_cells_have_its_values_and_are_judged_on_validation_instances(tuning: Tuning) -> None:
    setting = Setting("toy_reach", "toy_aim", 7, {"length": 0.25})
    cells = setting.cells(tuning, 1, "quick", 300)
    assert [cell.name for cell in cells] == [f"toy_reach/toy_aim/rung-1_setting-7/seed-0{seed}" for seed in (0, 1)]
    for resolved in resolve_cells(cells):
        assert resolved.config.method.length == 0.25
        assert (resolved.config.run.steps, resolved.config.run.evaluations) == (300, 1)
        assert resolved.config.run.instances == "validation"
        instances = resolved.problem().evaluation_instances()
        assert instances.tolist() == toy.ToyReach().validation_instances().tolist()


def test_a_cell_of_tuning_cannot_be_judged_on_evaluation_instances(tuning: Tuning) -> None:
    (cell, _) = Setting("toy_reach", "toy_aim", 0, {}).cells(tuning, 0, "quick", 300)
    asked = replace(cell, overrides=("instances=evaluation",))
    assert resolve_cell(asked).config.run.instances == "validation"


def test_seeds_are_those_of_tuning(tuning: Tuning) -> None:
    cells = Setting("toy_reach", "toy_aim", 0, {}).cells(tuning, 0, "quick", 300)
    assert {cell.seed for cell in cells} <= set(TUNING_SEEDS)


def test_methods_take_turns(tuning: Tuning) -> None:
    of_settings = [
        setting.cells(tuning, 0, "quick", 300)
        for method in tuning.methods
        for setting in settings_of(tuning, "toy_reach", method, "quick")
    ]
    assert [cell.method for cell in cells_in_turn(of_settings)] == ["toy_aim", "toy_search"] * 6


def test_a_method_without_ranges_is_named(tuning: Tuning, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(toy.Config, "not_searched", ("episodes", "step_size"), raising=False)
    with pytest.raises(UserError, match="'toy_search' declares no range"):
        settings_of(tuning, "toy_reach", "toy_search", "quick")
