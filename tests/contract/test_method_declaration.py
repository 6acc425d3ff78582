"""Each check of what a method declares finds the fault that it is there for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from codesign_bench import registry
from codesign_bench.contract import Check, Subject, ask
from codesign_bench.contract import method_declaration as checks
from codesign_bench.method import Method, load_method, method_names
from contract_faults import FaultsOf, text_of
from sound import SoundSearch, changed_method


@dataclass
class Thawed:
    """A configuration that can be changed."""

    episodes: int = 4


@dataclass(frozen=True)
class Demanding:
    """A configuration that must be given."""

    episodes: int


class Unfinished(SoundSearch):
    """A method without a policy."""

    policy = Method.policy
    __abstractmethods__ = frozenset({"policy"})


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.hyperparameters_have_defaults, {"config_class": Thawed}, "`config_class` is Thawed"),
        (checks.hyperparameters_have_defaults, {"config_class": Demanding}, "no default: episodes"),
        (checks.hyperparameters_have_defaults, {"small": classmethod(lambda cls: {"batch": 1})}, "`small` sets batch"),
        (
            checks.profiles_are_valid,
            {"profile": classmethod(lambda cls, profile, task: {"speed": (1, "ours")})},
            "profile 'quick' on '",
        ),
        (
            checks.profiles_are_valid,
            {"profile": classmethod(lambda cls, profile, task: {"speed": (1, "ours")} if "else" in task else {})},
            "on an unknown task sets {'speed'}",
        ),
        (
            checks.profiles_are_valid,
            {"profile": classmethod(lambda cls, profile, task: {"speed": (1, "ours")} if "else" in profile else {})},
            "an unknown profile sets {'speed'}",
        ),
    ],
)
def test_what_is_wrong_is_found(
    method_faults: FaultsOf, check: Check[Subject], changes: dict[str, Any], found: str
) -> None:
    assert found in method_faults(check, **changes)


def test_a_label_that_another_method_has_is_found(method_faults: FaultsOf) -> None:
    other = method_names()[0]
    found = method_faults(checks.label_is_its_own, label=load_method(other).label)
    assert f"is the label of {other}, too" in found


@pytest.mark.parametrize(
    ("method_class", "found"),
    [
        (changed_method(name="other"), "its name is 'other'"),
        (Unfinished, "Unfinished lacks: policy"),
        (type("Bare", (Method,), {}), "Bare has no `name`"),
    ],
    ids=["name", "abstract", "bare"],
)
def test_a_method_that_cannot_be_used_says_what_is_missing(
    toy: None, method_class: type[Method[Any]], found: str
) -> None:
    registry.register("methods", "asked", lambda: method_class)
    assert found in text_of(ask(checks.loads, "asked"))
