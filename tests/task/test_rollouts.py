"""A refused call of an environment changes nothing: what follows is the same to the last bit as without the call."""

from __future__ import annotations

import copy
import pickle  # only `dumps`, which must refuse; nothing is read
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest

from codesign_bench.task import load_task, task_names
from codesign_bench.task.envs import ToolEnv, ToolVectorEnv, environment_id, register_environments
from codesign_bench.task.episodes import Tradeoff

register_environments()
EVERY_TASK = pytest.mark.parametrize("task_name", task_names())
COUNT, STEPS, SEED = 3, 12, 11
TRADEOFF = Tradeoff(alpha=0.5, scale=0.1)

Call = Callable[[Any], Any]


def wrong_actions(single: tuple[int, ...], count: int | None) -> dict[str, np.ndarray]:
    """Return actions that no environment with actions of shape `single`, or `count` of them, may accept."""
    (size,) = single
    shape = single if count is None else (count, size)
    shapes = [(), (1,), (size - 1,), (size + 1,), (1, *shape), (*shape, 1)]
    if count is not None:
        shapes += [single, (count - 1, size), (count + 1, size), (count, 1), (1, size), (size, count)]
    wrong = {f"shape {given}": np.full(given, 0.5) for given in shapes if given != shape}
    for bad in (np.nan, np.inf, -np.inf):
        for entry in (0, size - 1):
            actions = np.zeros(shape)
            actions[..., entry][() if count is None else -1] = bad
            wrong[f"{bad} in entry {entry}"] = actions
    wrong["text"] = np.full(shape, "0.5")
    return wrong


def wrong_instances(task_name: str) -> dict[str, Any]:
    """Return instances that no environment of a task may accept."""
    space = load_task(task_name).instance_space
    (low, high), size = space.bounds, space.size
    wrong: dict[str, Any] = {"short": low[:-1], "long": np.append(low, 0.0), "rows": np.tile(low, (COUNT + 1, 1))}
    wrong |= {"scalar": 0.5, "text": "start", "ragged": [[0.0], [0.0, 1.0]]}
    for entry in range(size):
        for value in (np.nan, np.inf, -np.inf, 1e30, high[entry] + 1e3 * (high - low)[entry]):
            wrong[f"{space.names[entry]} = {value}"] = np.where(np.arange(size) == entry, value, low)
        wrong[f"{space.names[entry]} just outside"] = np.where(
            np.arange(size) == entry, high + 0.01 * (high - low), low
        )
    return wrong


def refused(call: Call, env: Any, kind: type[Exception] = ValueError) -> None:
    """Assert that a call of `env` is refused in one line."""
    with pytest.raises(kind) as error:
        call(env)
    assert len(str(error.value).splitlines()) == 1


def trajectory(make: Callable[[], Any], shape: tuple[int, ...], disturb: Call | None) -> list[Any]:
    """Return all that an environment gives back in two resets and some steps, with `disturb` called in between."""
    env, rng, told = make(), np.random.default_rng(0), []
    upset = disturb or (lambda env: None)
    for seed in (SEED, None):
        told.append(env.reset(seed=seed))
        for _ in range(STEPS):
            upset(env)
            told.append(env.step(rng.uniform(-1.0, 1.0, shape).astype(np.float32)))
    upset(env)
    told.append(env.reset())
    return told


def assert_same(first: Any, second: Any) -> None:
    """Assert that two nested results are equal to the last bit."""
    assert type(first) is type(second)
    if isinstance(first, dict):
        assert first.keys() == second.keys()
        first, second = list(first.values()), list(second.values())
    if isinstance(first, list | tuple):
        assert len(first) == len(second)
        for one, other in zip(first, second, strict=True):
            assert_same(one, other)
    else:
        np.testing.assert_array_equal(first, second)


@EVERY_TASK
def test_refused_calls_of_an_environment_leave_no_trace(task_name: str) -> None:
    shape = ToolEnv(task_name).action_space.shape
    assert shape is not None

    def disturb(env: Any) -> None:
        for action in wrong_actions(shape, None).values():
            refused(lambda env, action=action: env.step(action), env)  # type: ignore[misc]
        for instance in wrong_instances(task_name).values():
            refused(lambda env, given=instance: env.reset(seed=1, options={"instance": given}), env)  # type: ignore[misc]
        refused(lambda env: env.reset(seed=-1), env, gymnasium.error.Error)

    def make() -> ToolEnv:
        return ToolEnv(task_name, TRADEOFF)

    assert_same(trajectory(make, shape, disturb), trajectory(make, shape, None))


@EVERY_TASK
def test_refused_calls_of_a_vector_leave_no_trace_in_any_of_its_environments(task_name: str) -> None:
    env = ToolVectorEnv(task_name, COUNT)
    shape, single = env.action_space.shape, env.single_action_space.shape
    assert shape is not None
    assert single is not None
    instance = load_task(task_name).instance_space.bounds[0]
    wrong_options: list[dict[str, Any]] = [{"instance": given} for given in wrong_instances(task_name).values()]
    for mask in (np.zeros(COUNT, bool), np.ones(COUNT - 1, bool), np.ones(COUNT + 1, bool), np.arange(COUNT), True):
        wrong_options.append({"reset_mask": mask, "instance": instance})

    def disturb(env: Any) -> None:
        for actions in wrong_actions(single, COUNT).values():
            refused(lambda env, actions=actions: env.step(actions), env)  # type: ignore[misc]
        for options in wrong_options:
            refused(lambda env, options=options: env.reset(seed=1, options=options), env)  # type: ignore[misc]
        refused(lambda env: env.reset(seed=[1] * (COUNT - 1)), env)
        refused(lambda env: env.reset(seed=[1] * (COUNT - 1) + [-1]), env, gymnasium.error.Error)

    def make() -> ToolVectorEnv:
        return ToolVectorEnv(task_name, COUNT, TRADEOFF)

    assert_same(trajectory(make, shape, disturb), trajectory(make, shape, None))


@EVERY_TASK
def test_environments_in_different_phases_take_a_step_together_or_not_at_all(task_name: str) -> None:
    env = ToolVectorEnv(task_name, 2)
    zero = np.zeros(env.action_space.shape or (), dtype=np.float32)
    env.reset(seed=0)
    env.step(zero)
    before, _ = env.reset(seed=[4, None], options={"reset_mask": np.array([True, False])})
    bad = zero.copy()
    bad[1, -1] = np.nan  # the first environment designs, the second one controls
    with pytest.raises(ValueError, match="not finite"):
        env.step(bad)
    np.testing.assert_array_equal(env._rollouts.episodes.observation, before)
    phase = env.task.layout.phase
    assert env.step(zero)[0][:, phase][:, :2].tolist() == [[0.0, 1.0], [0.0, 1.0]]


@EVERY_TASK
@pytest.mark.parametrize("how", [copy.copy, copy.deepcopy, pickle.dumps])
@pytest.mark.parametrize("started", [False, True], ids=["new", "started"])
def test_an_environment_refuses_to_be_copied_in_one_line(task_name: str, how: Call, started: bool) -> None:
    for env in (ToolEnv(task_name), ToolVectorEnv(task_name, 2)):
        if started:
            env.reset(seed=0)
            env.step(np.zeros(env.action_space.shape or (), dtype=np.float32))
        episodes = env._rollouts.episodes
        for thing in (env, episodes, episodes.simulator):
            refused(how, thing, TypeError)


@EVERY_TASK
def test_a_wrapped_environment_refuses_too(task_name: str) -> None:
    env = gymnasium.make(environment_id(task_name))
    for how in (copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="cannot be copied or pickled"):
            how(env)


def test_the_advice_for_copies_holds(toy: None) -> None:
    first, second = (ToolEnv("toy_reach") for _ in range(2))
    instance = first.task.evaluation_instances()[0]
    for env in (first, second):
        env.reset(options={"instance": instance})
    for action in np.random.default_rng(0).uniform(-1.0, 1.0, (2, *(first.action_space.shape or ()))):
        assert_same(first.step(action), second.step(action))


@EVERY_TASK
def test_nothing_happens_before_the_first_reset(task_name: str) -> None:
    draws = load_task(task_name).make_simulator(1).draws
    mode = "rgb_array" if draws else None
    single, several = ToolEnv(task_name, render_mode=mode), ToolVectorEnv(task_name, 2, render_mode=mode)
    several.reset(options={"reset_mask": np.array([True, False])})
    for env in (single, several):
        with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before step\(\)"):
            env.step(np.zeros(env.action_space.shape or ()))
        if draws:
            with pytest.raises(gymnasium.error.ResetNeeded, match=r"call reset\(\) before render\(\)"):
                env.render()


@pytest.mark.parametrize("count", [0, -1, 2.0, "2", None])
def test_a_vector_has_at_least_one_environment(toy: None, count: Any) -> None:
    with pytest.raises(ValueError, match="num_envs must be a positive integer, not"):
        ToolVectorEnv("toy_reach", count)


def test_an_unknown_render_mode_is_refused_with_the_choices(toy: None) -> None:
    for make in (ToolEnv, ToolVectorEnv):
        with pytest.raises(ValueError, match="the task 'push' has rgb_array"):
            make("push", render_mode="human")


@pytest.mark.parametrize(("alpha", "scale"), [(np.nan, 1.0), (1.5, 1.0), (-0.1, 1.0), (0.5, np.nan), (0.5, np.inf)])
def test_a_tradeoff_is_finite_and_weighs_two_parts(alpha: float, scale: float) -> None:
    with pytest.raises(ValueError, match=r"alpha must be in \[0, 1\] and scale finite"):
        Tradeoff(alpha, scale)


def test_seeds_may_be_numpy_integers(toy: None) -> None:
    env = ToolVectorEnv("toy_reach", np.int64(2))  # type: ignore[arg-type]
    first, _ = env.reset(seed=3)
    for seed in (np.int64(3), np.array([3, 4])):
        np.testing.assert_array_equal(env.reset(seed=seed)[0], first)  # type: ignore[arg-type]
