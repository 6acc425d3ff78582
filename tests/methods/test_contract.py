"""What every method promises: the contract that `codesign-bench check` asks of any method, on a real task.

Methods are small (`Method.small`), so that a batch has a few episodes.
"""

from __future__ import annotations

import pytest

from builders import assert_kept
from codesign_bench.contract import METHOD_CHECKS, Check, Subject, ask, examine_method
from codesign_bench.contract.method_policy import unlike_alone
from codesign_bench.errors import UserError
from codesign_bench.method import Method, load_method, method_names
from codesign_bench.task import Task
from tolerances import of_network


@pytest.mark.parametrize("name", method_names())
def test_a_method_can_be_loaded(name: str, push: Task) -> None:
    assert_kept(next(examine_method(name, push)))


@pytest.mark.parametrize("check", METHOD_CHECKS, ids=lambda check: check.name)
@pytest.mark.parametrize("name", method_names())
def test_a_method_keeps_the_contract(name: str, check: Check[Subject], push: Task) -> None:
    method_class = load_method(name)
    assert_kept(ask(check, Subject(method_class, push), method_class))


@pytest.mark.numeric
@pytest.mark.parametrize("name", method_names())
def test_actions_are_alike_alone_and_batched_but_for_rounding(name: str, push: Task) -> None:
    subject = Subject(load_method(name), push)
    # One row and many may be multiplied in another order. The longest way is a graph network's: one layer in, two
    # convolutions over a node and its neighbours, two layers of an index MLP; observations are normalised, at most 5.
    tolerance = of_network((push.layout.size, 2 * 16, 2 * 16, 16, 16), 5.0)
    assert list(unlike_alone(subject, subject.trained().policy(), tolerance)) == []


@pytest.mark.parametrize("name", method_names())
def test_a_method_that_cannot_start_from_a_policy_says_so(name: str, push: Task) -> None:
    subject = Subject(load_method(name), push)
    if subject.method_class.start_from is Method.start_from:
        with pytest.raises(UserError, match=f"method '{name}' cannot start from a trained policy"):
            subject.make().start_from(subject.make().policy().tensors())
