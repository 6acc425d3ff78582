"""`TorchRLEnv` keeps TorchRL's specs and plays the episodes of our batched environments."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from codesign_bench.task import load_task, task_names
from codesign_bench.task.envs import ToolVectorEnv

pytest.importorskip("torchrl")

import torch
from tensordict.nn import TensorDictModule
from torchrl.envs.utils import check_env_specs
from torchrl.objectives.value import GAE

from codesign_bench.adapters import TorchRLEnv

COUNT = 2


@pytest.mark.parametrize("task_name", task_names())
def test_its_specs_hold(task_name: str) -> None:
    check_env_specs(TorchRLEnv(task_name, COUNT), seed=0)


@pytest.mark.parametrize("task_name", ["push", "toy_reach"])
def test_it_plays_the_episodes_of_the_batched_environments(toy: None, task_name: str) -> None:
    env, envs = TorchRLEnv(task_name, COUNT), ToolVectorEnv(task_name, COUNT)
    env.set_seed(5)
    torch.manual_seed(0)
    found = env.rollout(load_task(task_name).horizon + 10, break_when_any_done=False)
    start, _ = envs.reset(seed=5)
    np.testing.assert_array_equal(found["observation"][:, 0], start)
    for step in range(found.shape[1]):
        if step and found["next", "done"][:, step - 1].any():
            mask = found["next", "done"][:, step - 1, 0].numpy()
            np.testing.assert_array_equal(found["observation"][:, step], envs.reset(options={"reset_mask": mask})[0])
        observation, reward, terminated, truncated, info = envs.advance(found["action"][:, step].numpy())
        following = found["next"][:, step]
        np.testing.assert_array_equal(following["observation"], observation)
        np.testing.assert_array_equal(following["reward"][:, 0], reward.astype(np.float32))
        np.testing.assert_array_equal(following["terminated"][:, 0], terminated)
        np.testing.assert_array_equal(following["truncated"][:, 0], truncated)
        np.testing.assert_array_equal(following["done"][:, 0], terminated | truncated)
        np.testing.assert_array_equal(following["success"][:, 0], info.get("success", np.zeros(COUNT, dtype=bool)))
    assert found["next", "done"].any(), "no episode ended: the test shows nothing"


def test_the_time_limit_is_bootstrapped_and_success_is_not(toy: None) -> None:
    env = TorchRLEnv("toy_reach", 2)
    horizon, discount = load_task("toy_reach").horizon, 0.5
    # The same tool of 0.55 m in both: it reaches the second goal at once and the first one never.
    start = env.reset(options={"instance": np.array([[0.05], [0.55]])})
    found = env.rollout(
        1 + horizon,
        TensorDictModule(lambda seen: torch.zeros(*seen.shape[:-1], 2), ["observation"], ["action"]),
        tensordict=start,
        auto_reset=False,
        break_when_all_done=True,
    )
    last = found["next", "done"][..., 0].int().argmax(1)
    assert last.tolist() == [horizon, 1]
    assert found["next", "truncated"][0, horizon]
    assert found["next", "terminated"][1, 1]
    assert found["next", "success"][:, -1, 0].tolist() == [False, True]
    assert not found["next", "reward"][1, 2:].any(), "an environment whose episode has ended stays as it is"
    value = TensorDictModule(lambda seen: torch.full((*seen.shape[:-1], 1), 8.0), ["observation"], ["state_value"])
    GAE(gamma=discount, lmbda=0.0, value_network=value)(found)
    assert found["value_target"][0, horizon] == found["next", "reward"][0, horizon] + discount * 8.0
    assert found["value_target"][1, 1] == found["next", "reward"][1, 1]


def test_a_step_after_the_end_is_refused(toy: None) -> None:
    env = TorchRLEnv("toy_reach", 1)
    ended = env.rollout(1 + load_task("toy_reach").horizon)[:, -1]["next"]
    assert ended["done"].all()
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(env.rand_action(ended))
    env.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        env.reset()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_its_entries_are_on_its_device(toy: None) -> None:
    env = TorchRLEnv("toy_reach", 2, device="cuda")
    check_env_specs(env, seed=0)
    assert {entry.device.type for entry in env.rollout(3).values(True, True)} == {"cuda"}
