"""How the slots of a batch are counted and divided into groups, which cores may share: no number depends on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.learning import batches
from codesign_bench.learning.batches import BatchCollector, group_sizes, most_steps, slots_for
from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem, load_method, method_names
from codesign_bench.seeding import Streams
from codesign_bench.task import Singles, Slots, load_task


class Noise(Explorer):
    """Designs and controls that are noise alone."""

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        return Sample(np.clip(noise, -1.0, 1.0))

    sample_control = sample_design


@pytest.mark.parametrize(
    ("slots", "most", "sizes"),
    [
        (1, 1_000, [1]),
        (66, 1_000, [66]),
        (191, 1_000, [191]),
        (192, 1_000, [96, 96]),
        (331, 1_000, [166, 165]),
        (495, 1_000, [124, 124, 124, 123]),
        (24, 24, [24]),
        (25, 24, [13, 12]),
        (99, 24, [17, 17, 17, 16, 16, 16]),
    ],
)
def test_how_slots_are_grouped_follows_from_their_number_and_the_tasks_most(
    slots: int, most: int, sizes: list[int]
) -> None:
    assert group_sizes(slots, most) == sizes


@pytest.mark.parametrize(
    ("steps", "most", "expected"),
    [(600, None, 100), (30, None, 5), (1, None, 1), (600, 8, 8), (24, 8, 4)],
)
def test_as_many_slots_as_give_whole_episodes(steps: int, most: int | None, expected: int) -> None:
    assert slots_for(steps, episode_steps=6, most=most) == expected


def noise_for(problem: Problem) -> Noise:
    return Noise(problem.task.design_space.size, problem.task.control_space.size)


@pytest.mark.parametrize("remaining", [100, 1_000, 5_000, 9_885, 20_000])
def test_the_last_batch_exceeds_its_budget_by_at_most_two_percent_or_an_episode(remaining: int) -> None:
    # Wherever the number of slots is rounded down, each would play a second episode to the end.
    problem = Problem(load_task("push"))
    episode = problem.task.horizon + 1
    most = most_steps(20_000 - remaining, remaining)
    explorer = noise_for(problem)
    steps = min(remaining, 10_000)
    batch = BatchCollector(problem, Streams(0)).collect(explorer, steps, most=most)
    first_episodes = slots_for(steps, episode) * episode
    assert batch.env_steps <= max(most, first_episodes) <= remaining + max(400, episode)


def test_a_limit_that_leaves_room_changes_no_number() -> None:
    problem = Problem(load_task("push"))
    free, limited = (
        BatchCollector(problem, Streams(0)).collect(noise_for(problem), 1_000, most=most) for most in (None, 5_000)
    )
    assert free.reward.tobytes() == limited.reward.tobytes()
    assert free.env_steps == limited.env_steps


@pytest.fixture
def small_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several groups although batches are small."""
    monkeypatch.setattr(batches, "GROUP_SLOTS", 4)


def trained(
    make_learner: Callable[..., TwoPhaseLearner], cores: int, **settings: Any
) -> tuple[TwoPhaseLearner, list[dict[str, float]]]:
    """Return a learner after three batches of 16 slots in four groups, and its metrics."""
    learner = make_learner(batch_size=96, **settings)
    learner.use_cores(cores)
    return learner, [learner.train(96)[0].metrics for _ in range(3)]


@pytest.mark.usefixtures("small_groups")
@pytest.mark.parametrize(("credit", "cores"), [("separate", 3), ("joint", 2)])
def test_no_number_depends_on_the_cores(make_learner: Callable[..., TwoPhaseLearner], credit: str, cores: int) -> None:
    one, metrics = trained(make_learner, 1, design_credit=credit)
    more, same = trained(make_learner, cores, design_credit=credit)
    assert len(group_sizes(16, 1_000)) == 4
    assert metrics == same
    for name, array in one.state().arrays.items():
        np.testing.assert_array_equal(array, more.state().arrays[name], err_msg=name)
    assert one.streams.state() == more.streams.state()


@pytest.mark.usefixtures("toy", "small_groups")
@pytest.mark.parametrize("name", method_names())
def test_no_method_depends_on_the_cores_nor_does_its_evaluation(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    method_class, task = load_method(name), load_task("toy_reach")
    monkeypatch.setattr(type(task), "max_slots", 8)  # an evaluation in many parts
    policies, evaluations = [], []
    for cores in (1, 2):
        config: Any = method_class.config_class(**method_class.small())
        method = method_class(Problem(task), config, Streams(0))
        method.problem.simulators.use_cores(cores)
        method.use_cores(cores)
        method.train(96)  # Five groups at least, where a method rolls out in groups.
        policies.append(method.policy().tensors())
        evaluations.append(evaluate(task, method.policy(), simulators=method.problem.simulators))
    for key, array in policies[0].items():
        np.testing.assert_array_equal(array, policies[1][key], err_msg=key)
    for key, array in vars(evaluations[0]).items():
        np.testing.assert_array_equal(array, vars(evaluations[1])[key], err_msg=key)
