"""What a method gets without saying anything: the defaults of the class that every method extends."""

from __future__ import annotations

import pytest

from codesign_bench.errors import UserError
from codesign_bench.method import Method, Policy, Problem
from codesign_bench.method.method import BatchReport, State
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task
from toy import Config, ToySearch


class Silent(ToySearch):
    """Says nothing of what a method may leave out."""

    name = "silent"
    profile = Method.__dict__["profile"]
    start_from = Method.start_from


@pytest.fixture
def method(toy: None) -> Method[Config]:
    """A method of defaults on a task of five control steps."""
    return Silent(Problem(load_task("toy_reach")), Config(), Streams(0))


def test_a_method_has_general_values_in_every_profile(method: Method[Config]) -> None:
    assert dict(method.profile("paper", "push")) == {}
    assert dict(method.derived(Config(), "paper", "push")) == {}
    assert dict(method.small()) == {}


def test_the_shortest_batch_is_an_episode(method: Method[Config]) -> None:
    assert method.shortest_batch == 1 + 5  # the design step and five control steps


def test_cores_and_devices_are_offered_and_need_not_be_used(method: Method[Config]) -> None:
    before = method.state().arrays["best"].copy()
    method.use_cores(4)
    method.use_device("cuda")
    assert (method.state().arrays["best"] == before).all()


def test_a_method_that_cannot_start_from_a_policy_says_so_by_its_name(method: Method[Config]) -> None:
    with pytest.raises(UserError, match="method 'silent' cannot start from a trained policy"):
        method.start_from({})


def test_a_report_counts_no_gradient_steps_and_a_state_has_nothing_large_unless_told() -> None:
    assert BatchReport(10, {}).gradient_steps == 0
    first, second = State({}, {}), State({}, {})
    assert first.large == {}
    assert first.large is not second.large


def test_a_method_or_a_policy_without_its_parts_cannot_be_made() -> None:
    with pytest.raises(TypeError, match="abstract"):
        Method(None, None, None)  # type: ignore[abstract, arg-type]
    with pytest.raises(TypeError, match="abstract"):
        Policy()  # type: ignore[abstract]


def test_a_method_has_one_label_whatever_its_settings(method: Method[Config]) -> None:
    assert method.label_of(method.config) == method.label
