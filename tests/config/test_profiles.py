"""Profiles are found by name: the built-in ones, and those that studies add."""

from __future__ import annotations

from types import ModuleType

import pytest

from codesign_bench import registry
from codesign_bench.config.profiles import BUILT_IN, DEFAULT_PROFILE, Profile, profile_named, profiles
from codesign_bench.errors import UserError
from codesign_bench.study import Study

OVERNIGHT = Profile("overnight", "while you sleep")


@pytest.fixture
def study(toy: None) -> None:
    """A study with a profile of its own."""
    module = ModuleType("asked")
    module.STUDY = Study(  # type: ignore[attr-defined]
        name="asked", title="A study", question="Is it so?", claims=list, profiles=(OVERNIGHT,)
    )
    registry.register("studies", "asked", lambda: module)


def test_built_in_profiles_come_first_in_the_order_of_growing_cost() -> None:
    found = list(profiles().values())
    assert found[: len(BUILT_IN)] == list(BUILT_IN.values())
    costs = [profile.run["steps"].value for profile in BUILT_IN.values()]
    assert costs == sorted(costs)
    assert DEFAULT_PROFILE in BUILT_IN


@pytest.mark.usefixtures("study")
def test_a_study_adds_its_profiles() -> None:
    assert profile_named("overnight") is OVERNIGHT
    assert list(profiles())[-1] == "overnight"


def test_an_unknown_profile_is_answered_with_those_there_are() -> None:
    with pytest.raises(UserError, match="unknown profile 'overnight'; choose from: quick, laptop"):
        profile_named("overnight")


def test_a_profile_sets_no_hyperparameters_unless_told() -> None:
    assert OVERNIGHT.hyperparameters("gnn_ppo", "push") == {}
    assert (OVERNIGHT.run, OVERNIGHT.most_seeds) == ({}, None)
