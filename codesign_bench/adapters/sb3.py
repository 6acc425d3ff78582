"""Our batched environments as a `VecEnv` of stable-baselines3.

Shapes: `B` environments, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from codesign_bench.task.envs import ToolVectorEnv
from codesign_bench.task.episodes import Tradeoff
from codesign_bench.task.spaces import Booleans, Singles


class SB3VecEnv(VecEnv):
    """`num_envs` environments of a task in one process, for the learners of stable-baselines3.

    The step that ends an episode also begins the next one. Its observation is the first of the next episode; the last
    of the ended one is `info["terminal_observation"]` (O,). Every info has `TimeLimit.truncated`: whether the time
    limit ended the episode, so that learners bootstrap there. The infos of last steps also have `success`, as those of
    `ToolEnv`, and once more as `is_success`, from which stable-baselines3 logs `rollout/success_rate`.

    Episodes and infos are those of stable-baselines3's own `DummyVecEnv` around as many of `ToolEnv`, apart from
    `is_success`. `seed(s)` and `set_options({"instance": (I,) array})`, or a list of such options, take effect at the
    next `reset`. Wrap it in `VecMonitor` for returns and lengths of episodes.

    Raises:
        ValueError: `num_envs` is not a positive integer, or the task does not draw in `render_mode`.
    """

    def __init__(
        self, task_name: str, num_envs: int = 1, tradeoff: Tradeoff | None = None, render_mode: str | None = None
    ) -> None:
        self.vector_env = envs = ToolVectorEnv(task_name, num_envs, tradeoff, render_mode)
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)
        self._actions: Singles = np.zeros((self.num_envs, *self.action_space.shape), dtype=np.float32)

    def reset(self) -> Singles:
        """Begin an episode in every environment; return observations (B, O).

        Raises:
            ValueError: an instance has another shape or is not in the instance space.
        """
        instances = [options.get("instance") for options in self._options]
        given = np.array([instance is not None for instance in instances])
        observation: Singles = np.zeros((self.num_envs, *self.observation_space.shape), dtype=np.float32)
        if not given.all():
            observation, _ = self.vector_env.reset(seed=self._seeds, options={"reset_mask": ~given})
        if given.any():
            example = next(instance for instance in instances if instance is not None)
            rows = np.array([example if instance is None else instance for instance in instances])
            observation, _ = self.vector_env.reset(seed=self._seeds, options={"reset_mask": given, "instance": rows})
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: Singles) -> None:
        """Take note of `actions` (B, D + C)."""
        self._actions = actions

    def step_wait(self) -> tuple[Singles, Singles, Booleans, list[dict[str, Any]]]:
        """Step every environment; return observation (B, O), reward and done, each (B,), and infos.

        Raises:
            gymnasium.error.ResetNeeded: `reset` was never called.
            ValueError: the actions have another shape or are not finite.
        """
        observation, reward, terminated, truncated, merged = self.vector_env.advance(self._actions)
        done = terminated | truncated
        infos = self._infos(truncated, merged)
        if done.any():
            for slot in np.flatnonzero(done):
                success = bool(merged["success"][slot])
                infos[slot] |= {"success": success, "is_success": success, "terminal_observation": observation[slot]}
            observation, _ = self.vector_env.reset(options={"reset_mask": done})
        return observation, reward.astype(np.float32), done, infos

    def _infos(self, truncated: Booleans, merged: dict[str, Any]) -> list[dict[str, Any]]:
        """Return an info for each environment, with the terms of its reward on control steps."""
        infos: list[dict[str, Any]] = [{"TimeLimit.truncated": flag} for flag in truncated.tolist()]
        if "reward_terms" in merged:
            terms = {name: values for name, values in merged["reward_terms"].items() if not name.startswith("_")}
            rows = zip(*(values.tolist() for values in terms.values()), strict=True)
            for info, row, controlled in zip(infos, rows, merged["_reward_terms"].tolist(), strict=True):
                if controlled:
                    info["reward_terms"] = dict(zip(terms, row, strict=True))
        return infos

    def get_images(self) -> Sequence[Any]:
        """Return a picture of every scene with `render_mode="rgb_array"`; else None for each."""
        return self.vector_env.render() or [None] * self.num_envs

    def close(self) -> None:
        """Close the environments."""
        self.vector_env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the batch, once for each of `indices`; the environments have none of their own.

        Raises:
            AttributeError: the batch has no such attribute.
        """
        return [getattr(self.vector_env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: the environments have no attributes of their own.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError(f"cannot set {attr_name}: environments of a batch have no attributes of their own")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Refuse: the environments have no methods of their own.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError(f"cannot call {method_name}: environments of a batch have no methods of their own")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Any = None) -> list[bool]:
        """Return False for each of `indices`."""
        return [False] * len(list(self._get_indices(indices)))
