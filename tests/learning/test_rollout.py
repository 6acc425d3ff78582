"""Rollouts hold whole episodes and exactly what was simulated. Shapes: `S` slots, `T` steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from codesign_bench.learning.actor import GaussianExplorer
from codesign_bench.learning.rollout import Collector
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem
from codesign_bench.task import Task
from codesign_bench.task.episodes import Episodes, Tradeoff
from tolerances import of_sum

pytestmark = pytest.mark.numeric

STEPS, SLOTS = 60, 4


@pytest.fixture
def learner(make_learner: Callable[..., TwoPhaseLearner]) -> TwoPhaseLearner:
    """A learner whose actor is rolled out."""
    return make_learner()


def collect(learner: TwoPhaseLearner, seed: int = 1, problem: Problem | None = None) -> Trajectories:
    """Return a batch of the learner's actor."""
    collector = Collector(problem or learner.problem)
    return collector.collect(GaussianExplorer(learner.actor), STEPS, SLOTS, np.random.default_rng(seed))


def episodes_of(batch: Trajectories, slot: int) -> list[slice]:
    """Return the steps of each episode of a slot, its design step first."""
    starts = np.flatnonzero(batch.is_design[slot] & batch.valid[slot]).tolist()
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], int(batch.valid[slot].sum())], strict=True)]


def test_a_slot_holds_whole_episodes_that_begin_with_a_design_step(learner: TwoPhaseLearner, reach: Task) -> None:
    batch = collect(learner)
    for slot in range(SLOTS):
        count = int(batch.valid[slot].sum())
        assert batch.valid[slot, :count].all(), "valid steps come first, without gaps"
        assert STEPS / SLOTS <= count <= STEPS / SLOTS + reach.horizon
        for episode in episodes_of(batch, slot):
            ends = batch.episode_end[slot, episode]
            assert ends[-1]
            assert not ends[:-1].any()
            assert len(ends) <= reach.horizon + 1
            assert batch.is_design[slot, episode].sum() == 1
    assert not batch.episode_end[~batch.valid].any()
    assert not (batch.terminated & batch.truncated).any()
    assert batch.terminated.any()
    assert batch.truncated.any()


def test_env_steps_count_design_and_control_steps(learner: TwoPhaseLearner, monkeypatch: pytest.MonkeyPatch) -> None:
    simulated = 0

    def counted(call: Callable[..., Any]) -> Callable[..., Any]:
        def count(self: Episodes, slots: np.ndarray, actions: np.ndarray) -> Any:
            nonlocal simulated
            simulated += len(slots)
            return call(self, slots, actions)

        return count

    for name in ("design", "control"):
        monkeypatch.setattr(Episodes, name, counted(getattr(Episodes, name)))
    assert collect(learner).env_steps == simulated


def test_every_slot_holds_what_its_actions_alone_lead_to(learner: TwoPhaseLearner, reach: Task) -> None:
    batch, alone, zero = collect(learner), Episodes(reach, 1), np.array([0])
    # What is kept in single precision is rounded: the goal once, and a control in each step.
    layout, tolerance = reach.layout, of_sum(reach.horizon + 1, 2.0)
    for slot in range(SLOTS):
        for episode in episodes_of(batch, slot):
            seen, steps = batch.observation[slot, episode], range(episode.start + 1, episode.stop)
            alone.begin(zero, seen[:1, layout.goal].astype(float))
            np.testing.assert_array_equal(alone.observation[0], seen[0])
            alone.design(zero, batch.design[slot, [episode.start]].astype(float))
            for step in steps:
                np.testing.assert_allclose(alone.observation[0], batch.observation[slot, step], rtol=0, atol=tolerance)
                reward, terminated, truncated = alone.control(zero, batch.control[slot, [step]].astype(float))
                assert reward[0] == pytest.approx(batch.reward[slot, step], rel=0, abs=tolerance)
                assert (terminated[0], truncated[0]) == (batch.terminated[slot, step], batch.truncated[slot, step])
            if batch.truncated[slot, steps[-1]]:
                last = batch.final_observation[slot, steps[-1]]
                np.testing.assert_allclose(alone.observation[0], last, rtol=0, atol=tolerance)


def test_the_generator_decides_the_batch(learner: TwoPhaseLearner) -> None:
    first, again, other = collect(learner, 1), collect(learner, 1), collect(learner, 2)
    for name, values in {**vars(first), **first.extras}.items():
        if isinstance(values, np.ndarray):
            np.testing.assert_array_equal(values, {**vars(again), **again.extras}[name], err_msg=name)
    assert not np.array_equal(first.observation, other.observation)


def test_the_cutout_is_never_rolled_out(learner: TwoPhaseLearner, reach: Task) -> None:
    batch = collect(learner, problem=Problem(reach, cutout=0.5))
    assert batch.observation[batch.valid][:, reach.layout.goal].min() >= 0.5


def test_a_simulator_that_was_used_before_changes_nothing(learner: TwoPhaseLearner, reach: Task) -> None:
    used, fresh = Problem(reach), Problem(reach)
    with used.episodes(SLOTS + 3) as episodes:  # Wider, and left in the middle of an episode.
        slots = np.arange(SLOTS + 3)
        episodes.begin(slots, reach.evaluation_instances()[: SLOTS + 3])
        episodes.design(slots, np.ones((SLOTS + 3, 1)))
        episodes.control(slots, np.ones((SLOTS + 3, 1)))
    first, second = collect(learner, problem=used), collect(learner, problem=fresh)
    np.testing.assert_array_equal(first.observation, second.observation)
    np.testing.assert_array_equal(first.reward, second.reward)


def test_the_terms_of_the_reward_are_summed_over_the_batch(learner: TwoPhaseLearner, reach: Task) -> None:
    plain, weighed = collect(learner), collect(learner, problem=Problem(reach, tradeoff=Tradeoff(0.3, 2.0)))
    assert plain.reward_terms == {"task": pytest.approx(plain.reward.sum())}
    assert weighed.reward_terms["tradeoff"] == pytest.approx(weighed.reward.sum() - plain.reward.sum())
