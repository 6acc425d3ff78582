"""The Gymnasium environments: they keep Gymnasium's rules, and the batched one goes as the single one does."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from codesign_bench.task import load_task, task_names
from codesign_bench.task.envs import ToolEnv, ToolVectorEnv, environment_id, register_environments

register_environments()
EVERY_TASK = pytest.mark.parametrize("task_name", task_names())


def play(env: Any, actions: np.ndarray) -> list[tuple[np.ndarray, float, bool, bool, dict[str, Any]]]:
    """Take `actions` in a single environment, resetting after an episode's end as the vector environment does."""
    steps: list[tuple[np.ndarray, float, bool, bool, dict[str, Any]]] = []
    for action in actions:
        if steps and (steps[-1][2] or steps[-1][3]):
            steps.append((env.reset()[0], 0.0, False, False, {}))
        else:
            steps.append(env.step(action))
    return steps


@pytest.mark.parametrize(
    ("name", "identifier"), [("push", "Push"), ("catch_balls", "CatchBalls"), ("scoop_3d", "Scoop3D")]
)
def test_ids_follow_the_task_names(name: str, identifier: str) -> None:
    assert environment_id(name) == f"codesign_bench/{identifier}-v0"


@EVERY_TASK
def test_an_episode_is_one_design_step_and_then_control_until_the_horizon(task_name: str) -> None:
    env = ToolEnv(task_name)
    task = env.task
    layout = task.layout
    observation, _ = env.reset(seed=3)
    assert observation[layout.phase].tolist() == [1.0, 0.0, 0.0]
    assert not observation[layout.design].any()

    action = np.full(env.action_space.shape, 0.25, dtype=np.float32)
    observation, reward, terminated, truncated, info = env.step(action)
    assert (reward, terminated, truncated, info) == (0.0, False, False, {})
    assert observation[layout.phase].tolist() == [0.0, 1.0, 0.0]
    np.testing.assert_array_equal(observation[layout.design], np.float32(0.25))

    length = 0
    while not (terminated or truncated):
        assert "success" not in info
        observation, reward, terminated, truncated, info = env.step(0.0 * action)
        assert sum(info["reward_terms"].values()) == pytest.approx(reward)
        length += 1
        assert observation in env.observation_space
    assert length <= task.horizon
    assert truncated is (length == task.horizon and not terminated)
    assert isinstance(info["success"], bool)
    assert tuple(info["reward_terms"]) == tuple(task.reward_terms)
    assert {type(value) for value in info["reward_terms"].values()} == {float}
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(action)


@EVERY_TASK
def test_the_design_step_ignores_the_control_part_and_the_other_way_round(task_name: str) -> None:
    env = ToolEnv(task_name)
    size = env.task.design_space.size
    rng = np.random.default_rng(0)
    first, second = (rng.uniform(-1, 1, (20, *env.action_space.shape)).astype(np.float32) for _ in range(2))
    second[0, :size] = first[0, :size]
    second[1:, size:] = first[1:, size:]
    rollouts = []
    for actions in (first, second):
        env.reset(seed=0)
        rollouts.append([step[0] for step in play(env, actions)])
    np.testing.assert_array_equal(rollouts[0], rollouts[1])


@pytest.mark.numeric
@EVERY_TASK
def test_every_environment_of_a_batch_goes_as_it_does_alone(task_name: str) -> None:
    count, length = 3, load_task(task_name).horizon + 20
    envs = gymnasium.make_vec(environment_id(task_name), num_envs=count)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    actions = np.random.default_rng(1).uniform(-1, 1, (length, *envs.action_space.shape)).astype(np.float32)
    start, _ = envs.reset(seed=7)
    batched = [envs.step(action) for action in actions]
    for index in range(count):
        env = ToolEnv(task_name)
        np.testing.assert_array_equal(start[index], env.reset(seed=7 + index)[0])
        for together, alone in zip(batched, play(env, actions[:, index]), strict=True):
            np.testing.assert_array_equal(together[0][index], alone[0])
            assert [part[index] for part in together[1:4]] == list(alone[1:4])
            info = together[4]
            assert bool(info.get("_success", np.zeros(count, bool))[index]) is ("success" in alone[4])
            assert bool(info.get("success", np.zeros(count, bool))[index]) is alone[4].get("success", False)
    assert any("success" in step[4] for step in batched), "no episode ended: the test shows nothing"


def assert_same_info(first: dict[str, Any], second: dict[str, Any]) -> None:
    """Assert that two infos of batched environments hold the same, masks included."""
    assert first.keys() == second.keys()
    for key, values in first.items():
        if isinstance(values, dict):
            assert_same_info(values, second[key])
        else:
            assert values.dtype == second[key].dtype
            np.testing.assert_array_equal(values, second[key], err_msg=key)


@EVERY_TASK
def test_the_infos_of_a_batch_are_merged_as_gymnasium_merges_them(task_name: str) -> None:
    count, length = 2, load_task(task_name).horizon + 5
    batched: Any = gymnasium.make_vec(environment_id(task_name), num_envs=count)
    alone: Any = SyncVectorEnv([lambda: ToolEnv(task_name)] * count)
    rng, told = np.random.default_rng(2), set[str]()
    for envs in (batched, alone):
        envs.reset(seed=4)
    for _ in range(length):
        actions = rng.uniform(-1, 1, batched.action_space.shape).astype(np.float32)
        expected = alone.step(actions)[4]
        assert_same_info(batched.step(actions)[4], expected)
        told |= set(expected)
    assert told == {"reward_terms", "_reward_terms", "success", "_success"}


@EVERY_TASK
def test_an_instance_can_be_asked_for(task_name: str) -> None:
    task = load_task(task_name)
    instances = task.evaluation_instances()[:2]
    goals = instances[:, : task.goal_size].astype(np.float32)
    alone, _ = ToolEnv(task_name).reset(options={"instance": instances[1]})
    np.testing.assert_array_equal(alone[task.layout.goal], goals[1])
    envs = gymnasium.make_vec(environment_id(task_name), num_envs=2)
    together, _ = envs.reset(options={"instance": instances})
    np.testing.assert_array_equal(together[:, task.layout.goal], goals)
    with pytest.raises(ValueError, match="instance"):
        envs.reset(options={"instance": np.zeros(task.instance_space.size + 1)})


@EVERY_TASK
def test_a_reset_can_be_limited_to_some_environments(task_name: str) -> None:
    envs = gymnasium.make_vec(environment_id(task_name), num_envs=2)
    envs.reset(seed=0)
    before, *_ = envs.step(envs.action_space.sample())
    after, _ = envs.reset(seed=[None, 5], options={"reset_mask": np.array([False, True])})
    np.testing.assert_array_equal(after[0], before[0])
    np.testing.assert_array_equal(after[1], ToolEnv(task_name).reset(seed=5)[0])


def test_a_batch_can_be_stepped_in_part_and_begins_no_episode_by_itself(toy: None) -> None:
    together, one = ToolVectorEnv("toy_reach", 2), ToolEnv("toy_reach")
    with pytest.raises(gymnasium.error.ResetNeeded):
        together.advance(np.zeros((2, 2)))
    start, _ = together.reset(seed=3)
    one.reset(seed=3)
    only_first, actions = np.array([True, False]), np.full((2, 2), 0.5)
    ended = False
    while not ended:
        observation, reward, terminated, truncated, info = together.advance(actions, only_first)
        expected = one.step(actions[0])
        ended = expected[2] or expected[3]
        np.testing.assert_array_equal(observation[0], expected[0])
        assert [reward[0], terminated[0], truncated[0]] == list(expected[1:4])
        np.testing.assert_array_equal(observation[1], start[1])
        assert [reward[1], terminated[1], truncated[1]] == [0.0, False, False]
        assert not any(mask[1] for name, mask in info.items() if name.startswith("_"))
    assert info["_success"].tolist() == [True, False]
    with pytest.raises(gymnasium.error.ResetNeeded):
        together.advance(actions)
    assert "success" not in together.advance(actions, ~only_first)[4], "of the episode that had ended before"
    with pytest.raises(ValueError, match="mask has shape"):
        together.advance(actions, np.array([True]))


def test_a_closed_batch_gives_up_its_simulator(toy: None) -> None:
    envs = ToolVectorEnv("toy_reach", 2)
    envs.reset()
    envs.close()
    envs.close()
    for refused in (envs.reset, lambda: envs.step(np.zeros((2, 2)))):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError):
            refused()


@EVERY_TASK
def test_values_that_are_not_finite_are_refused(task_name: str) -> None:
    env = ToolEnv(task_name)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="finite"):
        env.step(np.full(env.action_space.shape, np.nan, dtype=np.float32))


def test_listing_environments_loads_neither_torch_nor_simulators() -> None:
    code = (
        "import sys, gymnasium, codesign_bench.task.envs as envs; envs.register_environments();"
        "assert any(name.startswith('codesign_bench/') for name in gymnasium.registry);"
        "loaded = {name.split('.')[0] for name in sys.modules};"
        "sys.exit(str(loaded & {'torch', 'pybullet', 'pymunk'}) if loaded & {'torch', 'pybullet', 'pymunk'} else 0)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 0, result.stderr


@EVERY_TASK
def test_environments_render_to_pictures(task_name: str) -> None:
    if not load_task(task_name).make_simulator(1).draws:
        pytest.skip("draws no pictures")
    one = gymnasium.make(environment_id(task_name), render_mode="rgb_array")
    one.reset(seed=0)
    picture: Any = one.render()
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 3
    two = gymnasium.make_vec(environment_id(task_name), num_envs=2, render_mode="rgb_array")
    two.reset(seed=0)
    pictures: Any = two.render()
    np.testing.assert_array_equal(pictures[0], picture)
    assert gymnasium.make(environment_id(task_name)).unwrapped.render() is None
