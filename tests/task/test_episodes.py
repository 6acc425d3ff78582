"""Two-phase episodes: the trade-off reward, and what a reward is the sum of."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import Floats, Simulator, Singles, Slots, Task, load_task
from codesign_bench.task.behaviours import Idle
from codesign_bench.task.episodes import Episodes, Tradeoff, portions
from codesign_bench.task.play import play
from toy import ToyReach

SLOTS = np.array([0, 1])
GOALS = np.array([[1.0], [0.5]])


@pytest.fixture
def task(toy: None) -> Task:
    """A stick of 0.1 to 1 m shall touch a goal on a line; its task names no terms of the reward."""
    return load_task("toy_reach")


def shortest(task: Task, tradeoff: Tradeoff | None) -> Episodes:
    """Return two episodes of sticks of 0.1 m, one control step after their design step."""
    episodes = Episodes(task, 2, tradeoff)
    episodes.begin(SLOTS, GOALS)
    episodes.design(SLOTS, np.full((2, 1), -1.0))
    assert episodes.reward_terms == {}
    episodes.control(SLOTS, np.zeros((2, 1)))
    return episodes


def test_the_tradeoff_reward_by_hand() -> None:
    material, effort = np.array([0.5, 0.0, 1.0]), np.array([0.2, 0.0, 1.0])
    # 2 [1 - (0.3 * 0.5 + 0.7 * 0.2)] = 2 (1 - 0.29) = 1.42; nothing used earns K; everything used earns nothing.
    np.testing.assert_allclose(Tradeoff(alpha=0.3, scale=2.0).reward(material, effort), [1.42, 2.0, 0.0], atol=1e-12)


def test_a_task_that_names_no_terms_has_one(task: Task) -> None:
    episodes = shortest(task, None)
    assert list(episodes.reward_terms) == ["task"]
    np.testing.assert_allclose(episodes.reward_terms["task"], [-0.9, -0.4])


def test_the_tradeoff_is_one_more_term(task: Task) -> None:
    episodes = shortest(task, Tradeoff(alpha=1.0, scale=2.0))
    assert list(episodes.reward_terms) == ["task", "tradeoff"]
    np.testing.assert_allclose(episodes.reward_terms["tradeoff"], 1.8)  # material 0.1: K (1 - alpha 0.1)


def test_many_episodes_are_played_in_portions_that_a_simulator_may_hold(task: Task) -> None:
    assert [len(part) for part in portions(2_500, task)] == [834, 833, 833]
    assert np.concatenate(portions(2_500, task)).tolist() == list(range(2_500))


class Broken(ToyReach):
    """Its simulator has faults of its own."""

    def __init__(self, fault: str) -> None:
        self.fault = fault

    def make_simulator(self, num_slots: int) -> Simulator:
        """Return a simulator with the fault."""
        if self.fault == "slots":
            return super().make_simulator(num_slots - 1)
        simulator = super().make_simulator(num_slots)
        if self.fault == "entries":
            simulator.state = np.zeros((num_slots, 3), dtype=np.float32)
        else:
            step = simulator.step

            def worse(slots: Slots, controls: Floats) -> None:
                step(slots, controls)
                getattr(simulator, self.fault)[slots[-1:]] = np.nan

            simulator.step = worse  # type: ignore[method-assign]
        return simulator


@pytest.mark.parametrize(
    ("fault", "told"), [("slots", "1 slots .* expected at least 2 slots"), ("entries", r"\(2, 3\).* 1 entries")]
)
def test_a_simulator_that_does_not_fit_its_task_is_refused_at_once(fault: str, told: str) -> None:
    with pytest.raises(TypeError, match=f"the simulator of task 'toy_reach' has .*{told}"):
        Episodes(Broken(fault), 2)


@pytest.mark.parametrize(("fault", "told"), [("state", "a state that is not finite: tip"), ("reward", "a reward")])
def test_a_simulator_whose_numbers_are_not_finite_is_named(fault: str, told: str) -> None:
    with pytest.raises(RuntimeError, match=f"task 'toy_reach' gave {told}"):
        shortest(Broken(fault), None)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_behaviour_that_diverged_is_refused_and_not_clipped(task: Task, bad: float) -> None:
    class Diverged(Idle):
        def act(self, observation: Singles) -> Singles:
            return super().act(observation) + np.float32(bad)

    with pytest.raises(ValueError, match=f"a control is not finite: speed = {bad}"):
        list(play(Episodes(task, 2), Diverged(task), GOALS))
