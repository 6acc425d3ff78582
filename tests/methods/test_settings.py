"""Settings that several methods share: our own profiles build on each other, and others have none."""

from __future__ import annotations

from importlib import import_module
from typing import Any

settings: Any = import_module("codesign_bench.methods._settings")

TABLE = {"laptop": {"gamma": 0.98, "epochs": 10}, "quick": {"epochs": 5}}


def test_quick_adds_to_laptop_and_every_value_names_the_profile_that_set_it() -> None:
    assert settings.tuned("laptop", TABLE) == {
        "gamma": (0.98, "laptop profile (ours)"),
        "epochs": (10, "laptop profile (ours)"),
    }
    assert settings.tuned("quick", TABLE) == {
        "gamma": (0.98, "laptop profile (ours)"),
        "epochs": (5, "quick profile (ours)"),
    }


def test_a_workstation_trains_longer_with_the_settings_of_a_laptop() -> None:
    assert settings.tuned("workstation", TABLE) == settings.tuned("laptop", TABLE)
    assert settings.ppo_settings("workstation", "lift_cup") == settings.ppo_settings("laptop", "lift_cup")


def test_profiles_of_others_set_nothing() -> None:
    assert settings.tuned("paper", TABLE) == {}
    assert settings.ppo_settings("paper", "lift_cup") == {}


def test_what_is_tuned_for_a_task_comes_last_and_says_so() -> None:
    general, lift_cup = (settings.ppo_settings("quick", task) for task in ("a_task_of_nobody", "lift_cup"))
    assert general["gamma"] == (0.98, "laptop profile (ours)")
    assert general["final_learning_rate_fraction"] == (1.0, "quick profile (ours)")
    assert lift_cup["gamma"] == (0.99, "tuned for lift_cup (ours)")
    assert lift_cup["final_learning_rate_fraction"] == general["final_learning_rate_fraction"]
