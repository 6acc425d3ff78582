"""Advantages by hand. Shapes: one slot, T steps; gamma and lambda are halves so that the numbers stay readable."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.learning.gae import episode_returns, generalized_advantages

pytestmark = pytest.mark.numeric


def advantages(gamma: float = 0.5, gae_lambda: float = 0.5, **rows: list[float]) -> list[float]:
    """Return the advantages of one slot, (T,), from rows (T,) of numbers."""
    arrays: dict[str, Any] = {name: np.array([row]) for name, row in rows.items()}
    flags = {name: arrays.pop(name).astype(bool) for name in ("terminated", "episode_end")}
    return generalized_advantages(**arrays, **flags, gamma=gamma, gae_lambda=gae_lambda)[0].tolist()


def test_success_is_not_bootstrapped() -> None:
    result = advantages(
        reward=[1.0, 2.0, 3.0],
        value=[4.0, 6.0, 8.0],
        next_value=[6.0, 8.0, 100.0],
        terminated=[0, 0, 1],
        episode_end=[0, 0, 1],
    )
    # Errors: 1 + 3 - 4 = 0; 2 + 4 - 6 = 0; 3 - 8 = -5. Each following advantage counts a quarter.
    assert result == [-5.0 / 16.0, -5.0 / 4.0, -5.0]


def test_the_time_limit_is_bootstrapped_by_the_state_reached() -> None:
    result = advantages(
        reward=[1.0, 2.0, 3.0],
        value=[4.0, 6.0, 8.0],
        next_value=[6.0, 8.0, 12.0],
        terminated=[0, 0, 0],
        episode_end=[0, 0, 1],
    )
    # The last error is 3 + 6 - 8 = 1.
    assert result == [1.0 / 16.0, 1.0 / 4.0, 1.0]


@pytest.mark.parametrize("terminated", [0, 1])
def test_nothing_leaks_over_the_end_of_an_episode(terminated: int) -> None:
    def first_episode(later: float) -> list[float]:
        return advantages(
            reward=[1.0, 2.0, later, later],
            value=[4.0, 6.0, later, later],
            next_value=[6.0, 2.0, later, later],
            terminated=[0, terminated, 0, 1],
            episode_end=[0, 1, 0, 1],
        )[:2]

    # The second error is 2 - 6 = -4 by success, 2 + 1 - 6 = -3 by the time limit.
    last = -4.0 if terminated else -3.0
    assert first_episode(0.0) == first_episode(1e6) == [last / 4.0, last]


def test_slots_are_independent() -> None:
    rng = np.random.default_rng(0)
    reward, value, next_value = rng.normal(size=(3, 5, 7))
    terminated, truncated = rng.random((2, 5, 7)) < 0.2
    given: dict[str, Any] = {
        "reward": reward,
        "value": value,
        "next_value": next_value,
        "terminated": terminated,
        "episode_end": terminated | truncated,
    }
    together = generalized_advantages(**given, gamma=0.9, gae_lambda=0.8)
    for slot in range(5):
        alone = generalized_advantages(
            **{name: rows[slot : slot + 1] for name, rows in given.items()}, gamma=0.9, gae_lambda=0.8
        )
        np.testing.assert_array_equal(alone[0], together[slot])


def test_lambda_one_is_the_discounted_return_minus_the_value() -> None:
    rng = np.random.default_rng(1)
    reward, value, gamma = rng.normal(size=10), rng.normal(size=11), 0.9
    result = advantages(
        gamma=gamma,
        gae_lambda=1.0,
        reward=reward.tolist(),
        value=value[:-1].tolist(),
        next_value=value[1:].tolist(),
        terminated=[0] * 10,
        episode_end=[0] * 9 + [1],
    )
    for step in range(10):
        powers = gamma ** np.arange(10 - step)
        expected = (powers * reward[step:]).sum() + gamma ** (10 - step) * value[-1] - value[step]
        assert result[step] == pytest.approx(expected)


def test_lambda_zero_is_the_one_step_error() -> None:
    result = advantages(
        gae_lambda=0.0,
        reward=[1.0, 2.0],
        value=[4.0, 6.0],
        next_value=[6.0, 8.0],
        terminated=[0, 0],
        episode_end=[0, 1],
    )
    assert result == [1.0 + 3.0 - 4.0, 2.0 + 4.0 - 6.0]


def test_returns_sum_to_the_end_of_each_episode() -> None:
    reward = np.array([[1.0, 2.0, 3.0, 10.0, 20.0]])
    ends = np.array([[False, False, True, False, True]])
    assert episode_returns(reward, ends).tolist() == [[6.0, 5.0, 3.0, 30.0, 20.0]]
