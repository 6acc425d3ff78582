"""Every value of a configuration comes from a named source, and bad values are refused in the user's words."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from codesign_bench.config.profiles import profile_named, profiles
from codesign_bench.config.resolve import check_overrides, differences, method_config, resolve
from codesign_bench.errors import UserError
from codesign_bench.method import Method, load_method, method_names

pytestmark = pytest.mark.usefixtures("toy")


@pytest.fixture
def search(toy: None) -> type[Method[Any]]:
    return load_method("toy_search")


def entry(config: Any, part: str, name: str) -> tuple[Any, str]:
    value, source = config.stored().parts[part][name]
    return value, source


def test_defaults_come_from_the_dataclass_with_the_source_that_a_field_names(search: type[Method[Any]]) -> None:
    config = resolve(search, "toy_reach", "laptop")
    assert entry(config, "method", "episodes") == (4, "default")
    assert entry(config, "method", "step_size") == (0.3, "toy paper, table 1")


def test_a_profile_overrides_defaults_and_the_command_line_overrides_profiles(search: type[Method[Any]]) -> None:
    config = resolve(search, "toy_reach", "paper")
    assert entry(config, "method", "episodes") == (8, "toy paper, table 2")
    assert entry(config, "run", "steps") == (10_000_000, "paper, learning curves")
    config = resolve(search, "toy_reach", "paper", ["episodes=3", "evaluations=7"], steps=500)
    assert entry(config, "method", "episodes") == (3, "--set")
    assert entry(config, "run", "evaluations") == (7, "--set")
    assert entry(config, "run", "steps") == (500, "--steps")
    assert (config.run.steps, config.run.evaluations, config.method.episodes) == (500, 7, 3)


def test_a_prefix_picks_the_method_or_the_run_settings(search: type[Method[Any]]) -> None:
    config = resolve(search, "toy_reach", "quick", ["toy_search.episodes=3", "other.episodes=9", "run.steps=40"])
    assert (config.method.episodes, config.run.steps) == (3, 40)


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("episodes=2.5", "an integer"),
        ("episodes=many", "an integer"),
        ("step_size=wide", "a number"),
        ("step_size=-1", "step_size must be positive"),
        ("greedy=perhaps", "true or false"),
        ("widths=8,wide", "an integer"),
        ("steps=0", "--set steps=0: expected an integer from 1 to 1,000,000,000,000"),
        ("evaluations=0", "--set evaluations=0: expected an integer from 1 to 100,000"),
    ],
)
def test_a_bad_value_is_the_users_error(search: type[Method[Any]], override: str, named: str) -> None:
    with pytest.raises(UserError, match=named):
        resolve(search, "toy_reach", "quick", [override])


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("episode=2", "unknown key 'episode'.*episodes"),
        ("toy_search.steps=2", "unknown key 'steps'"),
        ("gnn=2.", "unknown key 'gnn'"),
        ("other.episodes=2", "'other' is not a selected method.*toy_search"),
        ("episodes", "key=value"),
        ("=3", "key=value"),
    ],
)
def test_a_key_must_be_known_to_a_selected_method(search: type[Method[Any]], override: str, named: str) -> None:
    with pytest.raises(UserError, match=named):
        check_overrides([override], [search])


def test_an_unknown_profile_lists_the_profiles(search: type[Method[Any]]) -> None:
    with pytest.raises(UserError, match="unknown profile 'fast'; choose from: quick, laptop, workstation, paper"):
        resolve(search, "toy_reach", "fast")


def test_a_stored_configuration_is_rebuilt_and_compared_by_value(search: type[Method[Any]]) -> None:
    config = resolve(search, "toy_reach", "quick", ["widths=1,2"])
    assert method_config(search.config_class, config.stored().method) == config.method
    quick = [f"{name}={value}" for name, (value, _) in profile_named("quick").run.items()]
    same = resolve(search, "toy_reach", "laptop", ["widths=1,2", *quick])
    assert differences(config.stored(), same) == []
    other = resolve(search, "toy_reach", "quick", ["widths=1,3"])
    assert differences(config.stored(), other) == ["widths: stored [1, 2], requested [1, 3]"]


def test_a_value_that_is_newer_than_a_stored_configuration_counts_as_its_default(search: type[Method[Any]]) -> None:
    newer = resolve(search, "toy_reach", "quick").stored()
    stored = replace(newer, method={name: entry for name, entry in newer.method.items() if name != "step_size"})
    assert differences(stored, resolve(search, "toy_reach", "quick")) == []
    other = resolve(search, "toy_reach", "quick", ["step_size=0.5"])
    assert differences(stored, other) == ["step_size: stored 0.3, requested 0.5"]


def test_every_method_resolves_on_every_profile_and_on_a_task_it_has_never_heard_of() -> None:
    for name in method_names():
        for profile in profiles():
            parts = resolve(load_method(name), "toy_reach", profile).stored().parts
            assert all(source for settings in parts.values() for _, source in settings.values())


def test_what_a_variant_stands_for_comes_last(search: type[Method[Any]]) -> None:
    config = resolve(search, "toy_reach", "quick", ["episodes=3", "greedy=no"], variant_overrides=["episodes=5"])
    assert entry(config, "method", "episodes") == (5, "variant")
    assert entry(config, "method", "greedy") == (False, "--set")


def test_a_task_and_a_method_add_what_they_know_to_a_profile(search: type[Method[Any]], monkeypatch: Any) -> None:
    import toy

    monkeypatch.setattr(toy.ToyReach, "run_settings", {"quick": {"steps": 77}})
    monkeypatch.setattr(search, "derived", classmethod(lambda cls, config, *_: {"delay": (config.step_size, "half")}))
    config = resolve(search, "toy_reach", "quick")
    assert entry(config, "run", "steps") == (77, "tuned for toy_reach (ours)")
    assert entry(config, "method", "delay") == (0.3, "half")
    assert entry(resolve(search, "toy_reach", "laptop"), "run", "steps") == (1_000_000, "ours")
