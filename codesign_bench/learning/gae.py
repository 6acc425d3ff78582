"""Generalised advantage estimation (Schulman et al. 2016) with success and the time limit told apart.

Shapes: `S` slots, `T` steps; a slot's row holds whole episodes one after the other.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Booleans, Floats


def generalized_advantages(
    *,
    reward: Floats,
    value: Floats,
    next_value: Floats,
    terminated: Booleans,
    episode_end: Booleans,
    gamma: float,
    gae_lambda: float,
) -> Floats:
    """Return (S, T) advantages.

    Args:
        reward: (S, T) rewards.
        value: (S, T) value of the state in which each action was taken.
        next_value: (S, T) value of the state that followed; ignored where `terminated`.
        terminated: (S, T) the episode ended by success or failure: nothing follows, so nothing is bootstrapped.
        episode_end: (S, T) the episode's last step for whatever reason: no advantage flows back over it.
        gamma: discount of a step.
        gae_lambda: weight of longer estimates.
    """
    # The sum over k of (gamma lambda)^k error[t + k], taken backwards so that each step uses the sum behind it. Only
    # `terminated` ends bootstrapping, but every episode's end ends the sum: an episode that was cut off has a future,
    # which is not the next episode.
    error = reward + gamma * next_value * ~terminated - value
    advantage = np.zeros_like(error)
    following = np.zeros(error.shape[0])
    for step in range(error.shape[1] - 1, -1, -1):
        following = error[:, step] + gamma * gae_lambda * following * ~episode_end[:, step]
        advantage[:, step] = following
    return advantage


def episode_returns(reward: Floats, episode_end: Booleans) -> Floats:
    """Return the (S, T) undiscounted sums of rewards from each step to the end of its episode."""
    result = np.zeros_like(reward)
    following = np.zeros(reward.shape[0])
    for step in range(reward.shape[1] - 1, -1, -1):
        following = reward[:, step] + following * ~episode_end[:, step]
        result[:, step] = following
    return result
