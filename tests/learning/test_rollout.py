"""Rollouts hold whole episodes and exactly what was simulated. Shapes: `S` slots, `T` steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.episodes import Episodes
from codesign_bench.learning.ppo import gaussian
from codesign_bench.learning.rollout import (
    Collector,
    Trajectories,
    gaussian_log_prob,
    group_sizes,
    joined,
    slots_for,
)
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem
from codesign_bench.task import Task
from tolerances import of_network, of_sum

pytestmark = pytest.mark.numeric

STEPS, SLOTS = 60, 4


@pytest.fixture
def learner(make_learner: Callable[..., TwoPhaseLearner]) -> TwoPhaseLearner:
    """A learner whose actor is rolled out."""
    return make_learner()


def collect(learner: TwoPhaseLearner, seed: int = 1, steps: int = STEPS, slots: int = SLOTS) -> Trajectories:
    """Return a batch of the learner's actor."""
    collector = Collector(learner.problem)
    return collector.collect(learner.actor, steps, slots, np.random.default_rng(seed))


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


def test_stored_log_probabilities_are_those_of_the_stored_actions(learner: TwoPhaseLearner) -> None:
    batch = collect(learner)
    for distribution, action, rows in (
        (learner.actor.design, batch.design, batch.valid & batch.is_design),
        (learner.actor.control, batch.control, batch.valid & ~batch.is_design),
    ):
        seen, acted = torch.from_numpy(batch.observation[rows]), torch.from_numpy(action[rows])
        with torch.no_grad():
            mean, log_std = distribution(seen)
            expected, _ = gaussian(mean, log_std, acted)
            away = float(((acted - mean) / log_std.exp()).abs().max())
        # Half the squared distance from the mean, in deviations: an error of the mean, whose network sees normalised
        # observations, or of the action counts `away` times.
        error = of_network((seen.shape[1], 16, 16), 5.0) + of_sum(2, float(acted.abs().max()))
        tolerance = away * error / float(log_std.exp().min()) + of_sum(4, float(expected.abs().max()) + away**2)
        np.testing.assert_allclose(batch.log_prob[rows], expected.numpy(), rtol=0, atol=tolerance)


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
    for name, values in vars(first).items():
        np.testing.assert_array_equal(values, getattr(again, name), err_msg=name)
    assert not np.array_equal(first.observation, other.observation)


def test_given_designs_are_built(learner: TwoPhaseLearner) -> None:
    collector = Collector(learner.problem)
    given = np.linspace(-1.0, 1.0, SLOTS, dtype=np.float32)[:, None]
    batch = collector.collect(learner.actor, STEPS, SLOTS, np.random.default_rng(0), given)
    design = learner.problem.task.layout.design
    for slot in range(SLOTS):
        assert (batch.design[slot, batch.is_design[slot]] == given[slot]).all()
        controlling = batch.valid[slot] & ~batch.is_design[slot]
        assert (batch.observation[slot, controlling][:, design] == given[slot, 0]).all()


def test_the_cutout_is_never_rolled_out(learner: TwoPhaseLearner, reach: Task) -> None:
    collector = Collector(Problem(reach, cutout=0.5))
    batch = collector.collect(learner.actor, STEPS, SLOTS, np.random.default_rng(0))
    assert batch.observation[batch.valid][:, reach.layout.goal].min() >= 0.5


def test_summary_by_hand(learner: TwoPhaseLearner) -> None:
    batch = collect(learner)
    successes = int(batch.terminated.sum())  # Success is this task's only end besides the time limit.
    episodes = int(batch.is_design.sum())
    summary = batch.summary()
    assert summary["train_return"] == pytest.approx(batch.reward.sum() / episodes)
    assert summary["train_success"] == pytest.approx(successes / episodes)
    assert summary["train_episode_length"] == pytest.approx((batch.env_steps - episodes) / episodes)


@pytest.mark.parametrize(
    ("slots", "most", "sizes"),
    [
        (1, 1_000, [1]),
        (66, 1_000, [66]),
        (191, 1_000, [191]),
        (192, 1_000, [96, 96]),
        (331, 1_000, [166, 165]),
        (495, 1_000, [124, 124, 124, 123]),
        (24, 24, [24]),
        (25, 24, [13, 12]),
        (99, 24, [17, 17, 17, 16, 16, 16]),
    ],
)
def test_how_slots_are_grouped_follows_from_their_number_and_the_tasks_most(
    slots: int, most: int, sizes: list[int]
) -> None:
    assert group_sizes(slots, most) == sizes


def test_joined_groups_keep_their_slots_in_order_and_pad_with_steps_that_are_not_valid(
    learner: TwoPhaseLearner,
) -> None:
    short, long = collect(learner, seed=1, steps=20, slots=2), collect(learner, seed=2, steps=60, slots=3)
    batch = joined([short, long])
    assert batch.env_steps == short.env_steps + long.env_steps
    assert not batch.valid[:2, short.valid.shape[1] :].any()
    for name, values in vars(batch).items():
        np.testing.assert_array_equal(values[:2, : short.valid.shape[1]], getattr(short, name), err_msg=name)
        np.testing.assert_array_equal(values[2:, : long.valid.shape[1]], getattr(long, name), err_msg=name)


def test_gaussian_log_probability_equals_torchs() -> None:
    noise, log_std = np.array([[0.5, -1.0], [0.0, 2.0]], np.float32), np.array([-0.5, 0.3], np.float32)
    normal = torch.distributions.Normal(torch.zeros(2), torch.from_numpy(np.exp(log_std)))
    expected = normal.log_prob(torch.from_numpy(noise * np.exp(log_std))).sum(1).numpy()
    # Two numbers with a square, a product and a constant each; torch takes the square of a quotient.
    tolerance = of_sum(2 * 5, np.abs(expected).max() + 4.0)
    np.testing.assert_allclose(gaussian_log_prob(noise, log_std), expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    ("steps", "batch_size", "num_slots", "expected"),
    [(600, 600, None, 100), (30, 600, None, 5), (1, 600, None, 1), (600, 600, 8, 8), (10_000, 600, None, 100)],
)
def test_as_many_slots_as_give_whole_episodes(
    steps: int, batch_size: int, num_slots: int | None, expected: int
) -> None:
    assert slots_for(steps, batch_size, episode_steps=6, num_slots=num_slots) == expected
