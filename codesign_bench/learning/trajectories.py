"""Batches of whole episodes, for any collector and any learner.

Shapes: `S` slots, `T` steps, `n` valid steps, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from codesign_bench.learning.gae import episode_returns
from codesign_bench.task import Booleans, Floats, Singles


@dataclass(frozen=True)
class Trajectories:
    """Steps of whole episodes, consecutive within each slot; rows after a slot's last step are not `valid`."""

    observation: Singles
    """(S, T, O) observations of the explorer."""
    control: Singles
    """(S, T, C) sampled controls, before clipping; zero at design steps."""
    design: Singles
    """(S, T, D) sampled designs, before clipping; zero at control steps."""
    reward: Floats
    """(S, T)"""
    is_design: Booleans
    """(S, T)"""
    terminated: Booleans
    """(S, T)"""
    truncated: Booleans
    """(S, T)"""
    success: Booleans
    """(S, T) whether the step solved the task."""
    valid: Booleans
    """(S, T)"""
    final_observation: Singles
    """(S, T, O) the state after a truncated step; zero elsewhere."""
    extras: dict[str, Singles] = field(default_factory=dict)
    """Name -> (S, T, ...) values that the explorer stored with its actions; zero at steps without a value."""
    reward_terms: dict[str, float] = field(default_factory=dict)
    """Name -> sum over all steps of a reward term of the task or the trade-off."""

    @classmethod
    def empty(cls, slots: int, steps: int, observation: int, control: int, design: int) -> Trajectories:
        """Return zero-filled storage for `slots` x `steps` steps with the given sizes of observations and actions."""

        def singles(size: int) -> Singles:
            return np.zeros((slots, steps, size), dtype=np.float32)

        def booleans() -> Booleans:
            return np.zeros((slots, steps), dtype=bool)

        return cls(
            observation=singles(observation),
            control=singles(control),
            design=singles(design),
            reward=np.zeros((slots, steps)),
            is_design=booleans(),
            terminated=booleans(),
            truncated=booleans(),
            success=booleans(),
            valid=booleans(),
            final_observation=singles(observation),
        )

    @property
    def env_steps(self) -> int:
        """Number of environment steps, including design steps."""
        return int(self.valid.sum())

    @property
    def episode_end(self) -> Booleans:
        """(S, T) whether a step is the last of its episode."""
        return self.terminated | self.truncated

    @property
    def episode_returns(self) -> list[Floats]:
        """Of each slot, the undiscounted returns of its episodes in their order."""
        returns = episode_returns(self.reward, self.episode_end)
        return [returns[slot, self.is_design[slot]] for slot in range(len(returns))]

    @property
    def next_observation(self) -> Singles:
        """(S, T, O) the observation after each step, for learners on transitions; arbitrary after termination."""
        result = self.final_observation.copy()
        going = ~self.episode_end[:, :-1]
        result[:, :-1][going] = self.observation[:, 1:][going]
        return result

    def summary(self) -> dict[str, float]:
        """Return mean return, length and success rate of the sampled episodes, and the mean of each reward term."""
        episodes = max(1, int(self.episode_end.sum()))
        return {
            "train_return": float(self.reward.sum()) / episodes,
            "train_success": int(self.success.sum()) / episodes,
            "train_episode_length": float((self.valid & ~self.is_design).sum()) / episodes,
            **{f"reward_{name}": total / episodes for name, total in self.reward_terms.items()},
        }


def joined(groups: Sequence[Trajectories]) -> Trajectories:
    """Concatenate the slots of all groups into one batch, as long as its longest slot."""
    if len(groups) == 1:
        return groups[0]
    length = max(int(group.valid.sum(axis=1).max()) for group in groups)

    def together(arrays: Iterable[np.ndarray]) -> np.ndarray:
        # Filled in place, because padding every part first would hold one more copy of the batch.
        parts = [array[:, :length] for array in arrays]
        result = np.zeros((sum(map(len, parts)), length, *parts[0].shape[2:]), dtype=parts[0].dtype)
        for start, part in zip(accumulate(map(len, parts), initial=0), parts, strict=False):
            result[start : start + len(part), : part.shape[1]] = part
        return result

    first = vars(groups[0])
    arrays = {
        name: together(getattr(group, name) for group in groups) for name, value in first.items() if _is_array(value)
    }
    extras = {name: together(group.extras[name] for group in groups) for name in groups[0].extras}
    terms = {name: sum(group.reward_terms[name] for group in groups) for name in groups[0].reward_terms}
    return Trajectories(**arrays, extras=extras, reward_terms=terms)


def _is_array(value: object) -> bool:
    return isinstance(value, np.ndarray)
