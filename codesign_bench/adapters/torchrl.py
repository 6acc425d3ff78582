"""Our batched environments as an `EnvBase` of TorchRL.

Shapes: `B` environments, `O` observation, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Binary, Bounded, Composite, Unbounded
from torchrl.envs import EnvBase

from codesign_bench.task.envs import ToolVectorEnv
from codesign_bench.task.episodes import Tradeoff
from codesign_bench.task.spaces import Booleans, Singles


class TorchRLEnv(EnvBase):
    """`num_envs` environments of a task in one process, with batch size (B,), for the learners of TorchRL.

    Entries: `observation` (B, O), `action` (B, D + C), `reward`, `done`, `terminated` and `truncated`, each (B, 1), and
    `success` (B, 1), which is true on the last step of a solved episode. Collectors and rollouts begin the next episode
    of an environment by a reset of this environment alone, after the last observation was stored as
    `("next", "observation")`, so that estimators of advantages bootstrap at the time limit.

    `set_seed(s)` takes effect at the next `reset`: environment `i` then plays the episodes of `ToolEnv` after
    `reset(seed=s + i)`. `reset(options={"instance": ...})` begins given instances, (I,) for all or (B, I).

    Raises:
        ValueError: `num_envs` is not a positive integer.
    """

    def __init__(
        self, task_name: str, num_envs: int = 1, tradeoff: Tradeoff | None = None, device: torch.device | str = "cpu"
    ) -> None:
        self.vector_env = ToolVectorEnv(task_name, num_envs, tradeoff)
        count = self.vector_env.num_envs
        super().__init__(device=device, batch_size=torch.Size([count]))
        self.observation_spec = Composite(
            observation=_bounded(self.vector_env.observation_space, self.device),
            success=self._flag(),
            shape=self.batch_size,
        )
        self.action_spec = _bounded(self.vector_env.action_space, self.device)
        self.reward_spec = Unbounded(shape=(count, 1), dtype=torch.float32, device=self.device)
        self.done_spec = Composite(
            done=self._flag(), terminated=self._flag(), truncated=self._flag(), shape=self.batch_size
        )
        self._seed: int | None = None
        self._terminated, self._truncated, self._success = np.zeros((3, count), dtype=bool)

    def _flag(self) -> Binary:
        return Binary(n=1, shape=(*self.batch_size, 1), dtype=torch.bool, device=self.device)

    def _reset(self, tensordict: TensorDictBase | None = None, **keywords: Any) -> TensorDictBase:
        """Begin an episode in every environment, or in those of the entry `_reset`."""
        mask = _mask(tensordict, "_reset", len(self._success))
        options = {**(keywords.get("options") or {}), "reset_mask": mask}
        observation, _ = self.vector_env.reset(seed=self._seed, options=options)
        self._seed = None
        for flags in (self._terminated, self._truncated, self._success):
            flags[mask] = False
        return self._entries(observation)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Step every environment, or those of the entry `_step`; the others stay as they are and get reward 0."""
        mask = _mask(tensordict, "_step", len(self._success))
        actions = tensordict["action"].detach().cpu().numpy()
        observation, reward, terminated, truncated, info = self.vector_env.advance(actions, mask)
        self._terminated[mask], self._truncated[mask] = terminated[mask], truncated[mask]
        if "success" in info:
            self._success |= info["success"]
        entries = self._entries(observation)
        entries["reward"] = self._column(reward.astype(np.float32))
        return entries

    def close(self, **keywords: Any) -> None:
        """Give up the simulator."""
        self.vector_env.close()
        super().close(**keywords)

    def _set_seed(self, seed: int | None) -> None:
        self._seed = seed

    def _entries(self, observation: Singles) -> TensorDict:
        """Return what resets and steps have in common."""
        return TensorDict(
            {
                "observation": torch.from_numpy(observation).to(self.device),
                "success": self._column(self._success),
                "terminated": self._column(self._terminated),
                "truncated": self._column(self._truncated),
                "done": self._column(self._terminated | self._truncated),
            },
            batch_size=self.batch_size,
            device=self.device,
        )

    def _column(self, values: Any) -> torch.Tensor:
        return torch.tensor(values, device=self.device)[:, None]


def _bounded(space: Any, device: Any) -> Bounded:
    """Return the spec of a Gymnasium box."""
    low, high = torch.from_numpy(space.low), torch.from_numpy(space.high)
    return Bounded(low=low.to(device), high=high.to(device), shape=space.shape, dtype=torch.float32, device=device)


def _mask(tensordict: TensorDictBase | None, key: str, count: int) -> Booleans:
    """Return the mask (B,) in an entry; all true if there is none."""
    entry = None if tensordict is None else tensordict.get(key, None)
    if entry is None:
        return np.ones(count, dtype=bool)
    mask: Booleans = entry.reshape(count).cpu().numpy()
    return mask
