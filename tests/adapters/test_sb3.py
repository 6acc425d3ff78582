"""`SB3VecEnv` plays as stable-baselines3's own `DummyVecEnv` does, and its PPO bootstraps where time ran out."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from codesign_bench.task import load_task
from codesign_bench.task.envs import ToolEnv
from codesign_bench.task.episodes import Tradeoff

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

from codesign_bench.adapters import SB3VecEnv

COUNT = 2


def assert_same(one: Any, other: Any) -> None:
    """Assert that two entries of infos are the same: numbers, arrays, or dicts of these."""
    if isinstance(other, dict):
        assert one.keys() == other.keys()
        for key in other:
            assert_same(one[key], other[key])
    else:
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("task_name", ["push", "toy_reach"])
def test_it_goes_as_stable_baselines3s_own_environments_go(toy: None, task_name: str) -> None:
    tradeoff = Tradeoff(alpha=0.5, scale=1.0)
    ours, theirs = SB3VecEnv(task_name, COUNT, tradeoff), DummyVecEnv([lambda: ToolEnv(task_name, tradeoff)] * COUNT)
    rng, ended = np.random.default_rng(0), 0
    for envs in (ours, theirs):
        envs.seed(7)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    for _ in range(load_task(task_name).horizon + 10):
        actions = rng.uniform(-1, 1, (COUNT, *ours.action_space.shape)).astype(np.float32)
        *found, infos = ours.step(actions)
        *expected, their_infos = theirs.step(actions)
        for one, other in zip(found, expected, strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)
        for info, their_info, done in zip(infos, their_infos, found[2], strict=True):
            assert ("is_success" in info) is bool(done)
            assert info.pop("is_success", None) is info.get("success")
            assert_same(info, their_info)
            ended += done
    assert ended >= COUNT, "no episode ended: the test shows nothing"


def test_the_time_limit_truncates_and_success_does_not(toy: None) -> None:
    envs = SB3VecEnv("toy_reach", 1)
    length, goal = envs.observation_space.shape[0], load_task("toy_reach").layout.goal
    for steps, instance, success in ((1 + load_task("toy_reach").horizon, 0.05, False), (2, 0.55, True)):
        envs.set_options({"instance": np.array([instance])})
        envs.reset()
        # The first tool is too long and stays; the second reaches the goal at once.
        infos = [envs.step(np.array([[1.0 if not success else 0.0, 0.0]], dtype=np.float32)) for _ in range(steps)]
        observation, _, done, (info,) = infos[-1]
        assert done[0]
        assert (info["success"], info["is_success"], info["TimeLimit.truncated"]) == (success, success, not success)
        assert info["terminal_observation"].shape == (length,)
        assert info["terminal_observation"][goal] == np.float32(instance)
        assert observation[0, load_task("toy_reach").layout.phase].tolist() == [1.0, 0.0, 0.0]


def test_ppo_bootstraps_at_the_time_limit() -> None:
    envs = SB3VecEnv("push", 1)
    steps = load_task("push").horizon + 1
    model = PPO("MlpPolicy", envs, n_steps=steps, batch_size=steps, n_epochs=1, gamma=0.5, seed=3, device="cpu")
    seen: list[tuple[float, Any]] = []

    def watch(variables: dict[str, Any], _: dict[str, Any]) -> bool:
        info = variables["infos"][0]
        value = 0.0
        if info["TimeLimit.truncated"]:
            value = model.policy.predict_values(model.policy.obs_to_tensor(info["terminal_observation"])[0]).item()
        seen.append((float(variables["rewards"][0]), value))
        return True

    model.learn(steps, callback=watch)
    rewards, values = np.array(seen).T
    assert values[-1] != 0.0, "the episode was not truncated: the test shows nothing"
    np.testing.assert_allclose(model.rollout_buffer.rewards[:, 0], rewards + 0.5 * values, rtol=1e-6)


def test_instances_can_be_given_to_some_environments() -> None:
    task = load_task("push")
    envs = SB3VecEnv("push", 3)
    wanted = task.evaluation_instances()[0]
    envs.seed(4)
    envs.set_options([{}, {"instance": wanted}, {}])
    start = envs.reset()
    np.testing.assert_array_equal(start[1, task.layout.goal], wanted[: task.goal_size].astype(np.float32))
    for index in (0, 2):
        np.testing.assert_array_equal(start[index], ToolEnv("push").reset(seed=4 + index)[0])
    assert envs.reset()[1, task.layout.goal].tolist() != start[1, task.layout.goal].tolist(), "options count once"


def test_it_draws_and_answers_as_stable_baselines3_asks() -> None:
    envs = SB3VecEnv("push", 4, render_mode="rgb_array")
    envs.reset()
    height, width, _ = envs.get_images()[0].shape
    assert envs.render().shape == (2 * height, 2 * width, 3)
    assert envs.get_attr("task", indices=[0, 2]) == [envs.vector_env.task] * 2
    assert not envs.has_attr("no_such_attribute")
    assert envs.env_is_wrapped(VecMonitor) == [False] * 4
    for refused in (lambda: envs.set_attr("task", None), lambda: envs.env_method("reset")):
        with pytest.raises(NotImplementedError, match="of a batch"):
            refused()


def test_refused_calls_change_nothing_and_closed_environments_say_so() -> None:
    envs = SB3VecEnv("push", 2)
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.step(np.zeros((2, *envs.action_space.shape)))
    envs.reset()
    with pytest.raises(ValueError, match="finite"):
        envs.step(np.full((2, *envs.action_space.shape), np.nan))
    envs.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="closed"):
        envs.reset()
