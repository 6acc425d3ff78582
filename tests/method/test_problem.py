"""What a method is asked to learn: which instances it trains and is judged on, and the episodes that it is lent."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.method import Problem
from codesign_bench.task import Floats, Task, load_task
from codesign_bench.task.episodes import Tradeoff


@pytest.fixture
def reach(toy: None) -> Task:
    """A stick on a line, whose goals below a fraction can be held out."""
    return load_task("toy_reach")


def goals(problem: Problem, count: int = 200, seed: int = 0) -> Floats:
    """Return training instances."""
    return problem.sample_instances(np.random.default_rng(seed), count)


def test_without_more_the_instances_are_the_tasks_own(reach: Task) -> None:
    problem = Problem(reach)
    np.testing.assert_array_equal(goals(problem), reach.sample_instances(np.random.default_rng(0), 200))
    np.testing.assert_array_equal(problem.evaluation_instances(), reach.evaluation_instances())


def test_what_is_held_out_is_never_trained_on_and_still_judged_on(reach: Task) -> None:
    problem = Problem(reach, cutout=0.9)
    trained = goals(problem)
    assert trained.shape == (200, 1)
    assert (trained >= 0.9).all()
    whole = goals(Problem(reach))
    outside = whole[:, 0] >= 0.9
    np.testing.assert_array_equal(trained[outside], whole[outside], err_msg="what was not held out stays")
    assert (problem.evaluation_instances() < 0.9).any()


def test_given_instances_are_the_only_ones(reach: Task) -> None:
    given = np.array([[0.25], [0.75]])
    problem = Problem(reach, instances=given)
    assert set(goals(problem).ravel()) == {0.25, 0.75}
    assert problem.evaluation_instances() is given


def test_settings_are_chosen_on_other_instances(reach: Task) -> None:
    chosen = Problem(reach, validation=True).evaluation_instances()
    np.testing.assert_array_equal(chosen, reach.validation_instances())
    assert not set(chosen.ravel()) & set(reach.evaluation_instances().ravel())
    assert Problem(reach, instances=chosen[:2], validation=True).evaluation_instances().shape == (2, 1)


def test_lent_episodes_pay_the_tradeoff(reach: Task) -> None:
    slots, still = np.array([0]), np.zeros((1, 1))
    rewards = []
    for tradeoff in (None, Tradeoff(alpha=0.25, scale=2.0)):
        with Problem(reach, tradeoff=tradeoff).episodes(1) as episodes:
            episodes.begin(slots, np.array([[0.5]]))
            episodes.design(slots, np.array([[1.0]]))
            rewards.append(episodes.control(slots, still)[0][0])
    # The longest stick, 1 m, is half a metre too long; all material and no effort earn 2 (1 - 0.25).
    assert rewards == pytest.approx([-0.5, -0.5 + 1.5])


def test_evaluation_and_training_share_the_simulator(reach: Task) -> None:
    problem = Problem(reach)
    with problem.episodes(2) as first:
        simulator = first.simulator
    with problem.episodes(1) as second:
        assert second.simulator is simulator
