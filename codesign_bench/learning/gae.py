"""Generalised advantage estimation (Schulman et al. 2016) that distinguishes termination from the time limit.

Shapes: `S` slots, `T` steps; a slot's row contains consecutive whole episodes.
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
        next_value: (S, T) value of the next state; ignored where `terminated`.
        terminated: (S, T) whether success or failure ended the episode: the return ends, without bootstrapping.
        episode_end: (S, T) whether the step is its episode's last, for any reason: the sum of errors stops here.
        gamma: discount factor per step.
        gae_lambda: weight of longer estimates, lambda.
    """
    # The sum over k of (gamma lambda)^k error[t + k], computed backwards so that each step reuses the next step's sum.
    # Two masks are needed: bootstrapping stops only at `terminated`, but the sum stops at every end of an episode. An
    # episode that the time limit ended does have a future, but the row continues with another episode.
    #
    # The design step, first in its episode and with reward 0, needs no special case: its advantage is
    # gamma V(first control state) - V(design state) plus the discounted errors of the control steps.
    error = reward + gamma * next_value * ~terminated - value
    advantage = np.zeros_like(error)
    following = np.zeros(error.shape[0])
    for step in range(error.shape[1] - 1, -1, -1):
        following = error[:, step] + gamma * gae_lambda * following * ~episode_end[:, step]
        advantage[:, step] = following
    return advantage


def episode_returns(reward: Floats, episode_end: Booleans) -> Floats:
    """Return the (S, T) undiscounted sums of rewards from each step to the end of its episode.

    At the time limit nothing is bootstrapped: the sum is the episode's return.
    """
    result = np.zeros_like(reward)
    following = np.zeros(reward.shape[0])
    for step in range(reward.shape[1] - 1, -1, -1):
        following = reward[:, step] + following * ~episode_end[:, step]
        result[:, step] = following
    return result
