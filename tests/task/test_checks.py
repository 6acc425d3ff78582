"""Checks at the boundary of a task: what is refused, and that the message names both sides."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.task import Box
from codesign_bench.task.checks import check_finite, check_rows, check_slots, checked_actions, checked_instance
from codesign_bench.task.checks import checked_mask as mask

DESIGN, CONTROL = Box.of(length=(0.1, 1.0, "m")), Box.of(turn=(-1.0, 1.0, "1"), push=(-1.0, 1.0, "1"))
INSTANCE = Box.of(goal=(0.1, 0.7, "m"), friction=(0.0, 2.0, "1"))


@pytest.mark.parametrize("given", [[0.5, 0, -1], (True, False, True), np.array([1, 2, 3], dtype=np.uint8)])
def test_any_real_numbers_of_the_right_shape_are_an_action(given: Any) -> None:
    found = checked_actions(given, DESIGN, CONTROL)
    assert found.dtype == np.float64
    assert found.tolist() == [float(value) for value in given]


@pytest.mark.parametrize("shape", [(), (1,), (2,), (4,), (1, 3), (3, 1), (0,)])
def test_an_action_of_another_shape_is_refused_with_both_shapes_and_the_entries(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="the action space") as refused:
        checked_actions(np.zeros(shape), DESIGN, CONTROL)
    for part in (str(shape), "(3,)", "design (length)", "control (turn, push)"):
        assert part in str(refused.value)


@pytest.mark.parametrize("shape", [(3,), (1, 3), (3, 3), (2, 2), (2, 4), (2, 3, 1), (2, 1)])
def test_actions_of_a_batch_have_a_row_for_each_environment(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"the action space \(2, 3\)"):
        checked_actions(np.zeros(shape), DESIGN, CONTROL, 2)
    assert checked_actions(np.zeros((2, 3)), DESIGN, CONTROL, 2).shape == (2, 3)


@pytest.mark.parametrize(
    "given", [None, "abc", ["0", "0", "0"], [0.0, [1.0], 2.0], [1j, 0, 0], [object()] * 3, {"length": 1.0}]
)
def test_what_is_no_array_of_real_numbers_is_refused(given: Any) -> None:
    for refused in (checked_actions, checked_instance):
        spaces = (DESIGN, CONTROL) if refused is checked_actions else (INSTANCE,)
        with pytest.raises(ValueError, match="numbers"):
            refused(given, *spaces)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_named_with_its_entry_and_row(bad: float) -> None:
    actions = np.zeros((3, 3))
    actions[1, 2] = bad
    with pytest.raises(ValueError, match=rf"push = {bad} in row 1; the action space is \[-1, 1\]"):
        checked_actions(actions, DESIGN, CONTROL, 3)
    with pytest.raises(ValueError, match=rf"friction = {bad}; the instance space is goal 0.1 to 0.7 m, friction 0 to"):
        checked_instance([0.5, bad], INSTANCE)
    with pytest.raises(ValueError, match=rf"a design is not finite: length = {bad}"):
        check_finite(np.array([[bad]]), DESIGN, "a design")


@pytest.mark.parametrize("goal", [0.0999, 0.7001, 1e300, -1e300])
def test_an_instance_outside_its_space_is_refused_with_the_range(goal: float) -> None:
    with pytest.raises(
        ValueError, match=rf"goal = {goal:g}, outside the instance space: 0.1 to 0.7 m".replace("+", ".")
    ):
        checked_instance([goal, 1.0], INSTANCE)


def test_a_bound_in_single_precision_is_inside() -> None:
    for bounds in INSTANCE.bounds:
        assert checked_instance(bounds.astype(np.float32), INSTANCE).shape == (1, 2)
    assert float(np.float32(0.7)) != 0.7, "the test shows nothing if single precision holds the bound"


def test_an_instance_is_for_all_environments_or_one_for_each() -> None:
    both, slots = [[0.2, 1.0], [0.3, 1.0]], np.arange(2)
    assert checked_instance(both[0], INSTANCE, slots, 2).tolist() == [both[0]] * 2
    assert checked_instance(both, INSTANCE, slots, 2).tolist() == both
    for wrong in (np.full(3, 0.5), np.full((1, 2), 0.5), np.full((3, 2), 0.5), 0.5, np.full((2, 1), 0.5)):
        with pytest.raises(ValueError, match=r"the instance space \(2,\) or \(2, 2\): goal, friction"):
            checked_instance(wrong, INSTANCE, slots, 2)


def test_rows_of_environments_that_are_not_reset_are_not_looked_at() -> None:
    assert checked_instance([[np.nan, 9.0], [0.3, 1.0]], INSTANCE, np.array([1]), 2).tolist() == [[0.3, 1.0]]


def test_a_mask_has_a_truth_value_for_each_environment() -> None:
    assert mask(None, 3).tolist() == [0, 1, 2]
    assert mask([True, False, True], 3).tolist() == [0, 2]
    for wrong in ([True], [True] * 4, [1, 0, 1], True, [[True] * 3], ["a"] * 3):
        with pytest.raises(ValueError, match=r"not \(3,\) and bool"):
            mask(wrong, 3)
    with pytest.raises(ValueError, match="chooses none of the 3 environments"):
        mask([False] * 3, 3)


@pytest.mark.parametrize("slots", [[-1], [3], [0, 0], [[0]], [0.0], [True]])
def test_slots_are_different_and_exist(slots: Any) -> None:
    check_slots(np.array([2, 0]), 3)
    with pytest.raises(ValueError, match="different slots among 0 to 2"):
        check_slots(np.array(slots), 3)


def test_there_is_a_row_for_every_slot() -> None:
    check_rows(np.zeros((2, 1)), np.arange(2), DESIGN, "designs")
    for shape in ((1, 1), (3, 1), (2, 2), (2,), ()):
        with pytest.raises(ValueError, match=r"expected \(2, 1\): length"):
            check_rows(np.zeros(shape), np.arange(2), DESIGN, "designs")
