"""One simulator serves all who borrow it in turn, and what they get out of it is what a new one would give."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import Simulator, Task, load_task, task_names
from codesign_bench.task.behaviours import RandomBehaviour
from codesign_bench.task.simulators import Simulators


@pytest.fixture
def simulators(toy: None) -> Simulators:
    """The simulators of the stick on a line."""
    return Simulators(load_task("toy_reach"))


def lent(simulators: Simulators, num_slots: int) -> Simulator:
    """Return the simulator that is lent to someone who asks for `num_slots` slots."""
    with simulators.lend(num_slots) as simulator:
        return simulator


def test_the_same_simulator_is_lent_again_while_it_is_wide_enough(simulators: Simulators) -> None:
    first = lent(simulators, 4)
    assert first.num_slots == 4
    assert lent(simulators, 2) is first
    wider = lent(simulators, 5)
    assert wider.num_slots == 5
    assert lent(simulators, 4) is wider, "the narrow one is gone"


def test_a_loan_within_a_loan_gets_its_own(simulators: Simulators) -> None:
    with simulators.lend(4) as outer, simulators.lend(2) as inner:
        assert inner is not outer
    assert lent(simulators, 1) is outer, "the wider one is kept"


def test_a_simulator_that_failed_is_not_lent_again(simulators: Simulators) -> None:
    broken = simulators.lend(4)
    with pytest.raises(ArithmeticError), broken as first:
        raise ArithmeticError
    assert lent(simulators, 4) is not first


def test_a_copy_such_as_another_process_gets_starts_without_a_simulator(simulators: Simulators) -> None:
    first = lent(simulators, 4)
    other = copy.deepcopy(simulators)  # by the same protocol as pickle, which sends it to a process
    assert other.task is not simulators.task
    assert lent(other, 1).num_slots == 1
    assert lent(simulators, 4) is first


def random_behaviour(task: Task, seed: int) -> RandomBehaviour:
    """Return random tools and controls, always the same for a seed."""
    return RandomBehaviour(task, np.random.default_rng(seed))


@pytest.mark.numeric
@pytest.mark.parametrize("name", task_names())
def test_what_was_played_before_changes_no_evaluation(name: str) -> None:
    task, simulators = load_task(name), Simulators(load_task(name))
    instances = task.evaluation_instances()[:6]
    evaluate(task, random_behaviour(task, 1), instances=task.evaluation_instances()[10:18], simulators=simulators)
    again = evaluate(task, random_behaviour(task, 2), instances=instances, simulators=simulators)
    fresh = evaluate(task, random_behaviour(task, 2), instances=instances)
    for column, values in vars(fresh).items():
        np.testing.assert_array_equal(values, getattr(again, column), err_msg=column)
