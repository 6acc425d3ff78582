"""What every method promises, checked for every method alike on a real task with batches of a few episodes.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.config.profiles import profiles
from codesign_bench.config.resolve import resolve
from codesign_bench.method import Method, Policy, load_method, method_names
from codesign_bench.storage.checkpoint import Checkpoint, Progress, load_checkpoint, save_checkpoint
from codesign_bench.task import Singles, Task, task_names
from codesign_bench.task.episodes import Episodes
from tolerances import of_network

MakeMethod = Callable[..., Method[Any]]
EVERY_METHOD = pytest.mark.parametrize("name", method_names())
BUDGET = 10_000
PATIENCE = 20


def observations(task: Task, count: int = 6) -> tuple[Singles, Singles]:
    """Return random observations (B, O) of the design and of the control phase."""
    rng, layout, episodes = np.random.default_rng(11), task.layout, Episodes(task, count)
    slots = np.arange(count)
    episodes.begin(slots, task.sample_instances(rng, count))
    designing = episodes.observation.copy()
    episodes.design(slots, rng.uniform(-1.0, 1.0, size=(count, task.design_space.size)))
    controlling = episodes.observation.copy()
    controlling[:, layout.state] = task.state_space.sample(rng, count)
    controlling[:, layout.phase.stop - 1] = np.arange(count) / task.horizon
    return designing, controlling


def actions(policy: Policy, task: Task) -> tuple[Singles, Singles]:
    """Return what a policy makes (B, D) and does (B, C) for random observations."""
    designing, controlling = observations(task)
    return policy.design(designing), policy.act(controlling)


def assert_same_state(first: Method[Any], second: Method[Any]) -> None:
    """Assert that two methods stand at the same point, to the last bit."""
    a, b = first.state(), second.state()
    assert a.values == b.values
    for arrays, others in ((a.arrays, b.arrays), (a.large, b.large)):
        assert arrays.keys() == others.keys()
        for name, array in arrays.items():
            np.testing.assert_array_equal(array, others[name], err_msg=name)


@EVERY_METHOD
def test_training_changes_the_policy(make_method: MakeMethod, name: str) -> None:
    method = make_method(name)
    before = method.policy().tensors()
    for _ in range(PATIENCE):  # Some methods change it with every batch, some when they found a better one.
        report = method.train(BUDGET)
        after = method.policy().tensors()
        assert before.keys() == after.keys()
        if any(not np.array_equal(before[key], after[key]) for key in before):
            break
    else:
        pytest.fail(f"{PATIENCE} batches changed nothing")
    assert report.metrics
    assert all(np.isfinite(value) for value in report.metrics.values())


@EVERY_METHOD
def test_a_method_designs_a_tool_per_goal_where_it_says_so_and_one_for_all_elsewhere(
    make_method: MakeMethod, name: str, push: Task
) -> None:
    method = make_method(name)
    # Some begin with one tool for all, and some search for a while before they choose.
    for _ in range(PATIENCE if method.tool_per_goal else 2):
        method.train(BUDGET)
        tools = np.unique(method.policy().design(observations(push)[0]), axis=0)
        if len(tools) > 1:
            break
    assert (len(tools) > 1) == method.tool_per_goal


@EVERY_METHOD
def test_reported_steps_are_the_simulated_ones(
    make_method: MakeMethod, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated = 0

    def counted(call: Callable[..., Any]) -> Callable[..., Any]:
        def count(self: Episodes, slots: np.ndarray, values: np.ndarray) -> Any:
            nonlocal simulated
            simulated += len(slots)
            return call(self, slots, values)

        return count

    for phase in ("design", "control"):
        monkeypatch.setattr(Episodes, phase, counted(getattr(Episodes, phase)))
    method = make_method(name)
    reported = [method.train(BUDGET).env_steps for _ in range(2)]
    assert min(reported) >= 1
    assert sum(reported) == simulated


@EVERY_METHOD
def test_the_seed_decides_all_numbers(make_method: MakeMethod, name: str) -> None:
    first, again, other = make_method(name), make_method(name), make_method(name, seed=1)
    for _ in range(2):
        assert first.train(BUDGET) == again.train(BUDGET)
        other.train(BUDGET)
    kept, others = first.policy().tensors(), other.policy().tensors()
    assert any(not np.array_equal(kept[key], others[key]) for key in kept)
    assert_same_state(first, again)


@pytest.mark.numeric
@EVERY_METHOD
def test_actions_are_finite_inside_the_bounds_and_alike_alone_and_batched(
    make_method: MakeMethod, name: str, push: Task
) -> None:
    method = make_method(name)
    method.train(BUDGET)
    policy = method.policy()
    designing, controlling = observations(push)
    # One row and many may be multiplied in another order. The longest way is a graph network's: one layer in, two
    # convolutions over a node and its neighbours, two layers of an index MLP; observations are normalised, at most 5.
    tolerance = of_network((push.layout.size, 2 * 16, 2 * 16, 16, 16), 5.0)
    for choose, seen, size in (
        (policy.design, designing, push.design_space.size),
        (policy.act, controlling, push.control_space.size),
    ):
        batched = choose(seen)
        assert batched.shape == (len(seen), size)
        assert batched.dtype == np.float32
        assert np.isfinite(batched).all()
        assert np.abs(batched).max() <= 1.0
        for row, expected in zip(seen, batched, strict=True):
            alone = choose(row)
            assert alone.shape == (size,)
            np.testing.assert_allclose(alone, expected, rtol=0, atol=tolerance)


@EVERY_METHOD
def test_a_policy_acts_alike_when_made_from_its_tensors(make_method: MakeMethod, name: str, push: Task) -> None:
    method = make_method(name)
    method.train(BUDGET)
    policy = method.policy()
    copy = type(method).make_policy(push, method.config, policy.tensors())
    for first, second in zip(actions(policy, push), actions(copy, push), strict=True):
        np.testing.assert_array_equal(first, second)
    for key, tensor in policy.tensors().items():
        np.testing.assert_array_equal(tensor, copy.tensors()[key], err_msg=key)


@EVERY_METHOD
def test_tensors_do_not_change_when_training_goes_on(make_method: MakeMethod, name: str) -> None:
    method = make_method(name)
    tensors = method.policy().tensors()
    kept = {key: tensor.copy() for key, tensor in tensors.items()}
    method.train(BUDGET)
    for key, tensor in tensors.items():
        np.testing.assert_array_equal(tensor, kept[key], err_msg=key)


@EVERY_METHOD
def test_an_interrupted_method_goes_on_identically_through_a_file(
    make_method: MakeMethod, name: str, tmp_path: Path, push: Task
) -> None:
    method, path = make_method(name), tmp_path / "checkpoint"
    left = BUDGET
    for _ in range(2):
        left -= method.train(left).env_steps
    save_checkpoint(path, Checkpoint(method.state(), method.streams.state(), Progress()))
    restored, checkpoint = make_method(name), load_checkpoint(path)
    assert checkpoint is not None
    restored.load_state(checkpoint.state)
    restored.streams.load_state(checkpoint.streams)
    for first, second in zip(actions(method.policy(), push), actions(restored.policy(), push), strict=True):
        np.testing.assert_array_equal(first, second)
    for _ in range(2):
        report = method.train(left)
        assert report == restored.train(left)
        left -= report.env_steps
    assert_same_state(method, restored)


@EVERY_METHOD
@pytest.mark.parametrize("profile", profiles())
def test_every_profile_makes_a_valid_configuration_for_every_task(name: str, profile: str) -> None:
    method_class = load_method(name)
    for task_name in task_names():
        parts = resolve(method_class, task_name, profile).stored().parts
        assert set(parts["method"]) == {field.name for field in fields(method_class.config_class)}
        assert all(source for settings in parts.values() for _, source in settings.values())
    assert method_class.profile(profile, "a_task_of_somebody_else").keys() <= parts["method"].keys()
    assert method_class.profile("a profile of somebody else", "push").keys() <= parts["method"].keys()


@EVERY_METHOD
def test_the_last_batch_of_a_small_budget_is_small(make_method: MakeMethod, name: str) -> None:
    method = make_method(name)
    assert 1 <= method.train(1).env_steps <= method.shortest_batch


@EVERY_METHOD
def test_no_global_generator_is_touched(make_method: MakeMethod, name: str) -> None:
    def states() -> list[bytes]:
        keys = np.random.get_state()[1]  # noqa: NPY002  # The point: nobody draws from it.
        return [np.asarray(keys).tobytes(), torch.get_rng_state().numpy().tobytes(), repr(random.getstate()).encode()]

    before = states()
    method = make_method(name)
    method.train(BUDGET)
    type(method).make_policy(method.problem.task, method.config, method.policy().tensors())
    assert states() == before


@EVERY_METHOD
def test_names_and_labels(name: str) -> None:
    method_class = load_method(name)
    assert method_class.name == name
    labels = [load_method(other).label for other in method_names()]
    assert labels.count(method_class.label) == 1
