"""Policies on a simulated arm: what is played and seen, and that the ideal arm is the task's own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from codesign_bench import load_task
from codesign_bench.deployment.conditions import Conditions
from codesign_bench.deployment.rollout import Deployment
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.seeding import generator
from codesign_bench.task import Behaviour, Floats, Singles, deployment_of
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.robot import IDEAL, PANDA

TASKS = ("fetch_cube", "lift_cup")
NEAR_START = np.array([-0.211, 0.633])
"""Of tool 4, in the task's frame: the script fetches it."""


class Watched(Behaviour):
    """A task's script that remembers what it was shown."""

    def __init__(self, script: Behaviour) -> None:
        self.script, self.seen = script, list[Singles]()

    def design(self, observation: Singles) -> Singles:
        return self.script.design(observation)

    def act(self, observation: Singles) -> Singles:
        self.seen.append(observation.copy())
        return self.script.act(observation)


def play(conditions: Conditions, instance: Floats = NEAR_START, task_name: str = "fetch_cube") -> tuple[Any, Any]:
    """Return the rollout of a task's script and what it was shown."""
    task = load_task(task_name)
    policy = Watched(task.script())
    deployment = Deployment(task, policy, conditions)
    return deployment.play(instance, deployment.unit_design(instance), generator(0, "test"), None), policy.seen


@pytest.mark.numeric
@pytest.mark.parametrize("name", TASKS)
def test_with_the_ideal_arm_and_nothing_changed_deployment_is_the_task_itself(name: str) -> None:
    task = load_task(name)
    instance = deployment_of(task).trials.own[3]
    expected = evaluate(task, task.script(), instances=instance[None])
    rollout, _ = play(Conditions(arm=IDEAL), instance, name)
    assert rollout.success == expected.successes[0]
    assert rollout.steps == expected.lengths[0]
    assert rollout.outcome == expected.outcomes[0], "to the last bit: the physics are the same"


@pytest.mark.numeric
@pytest.mark.parametrize("name", TASKS)
def test_a_tool_works_on_the_panda_as_it_does_on_the_gantry(name: str) -> None:
    instance = deployment_of(load_task(name)).trials.own[3]
    ideal, _ = play(Conditions(arm=IDEAL), instance, name)
    real, _ = play(Conditions(arm=PANDA), instance, name)
    assert ideal.success
    assert real.success
    assert abs(real.steps - ideal.steps) <= 0.3 * ideal.steps
    assert 0.0 < real.arm.tracking_error_mean < 0.01


def test_latency_shows_old_states_with_the_goal_design_and_phase_of_now() -> None:
    _, prompt = play(Conditions(arm=IDEAL))
    _, late = play(Conditions(arm=IDEAL, latency=2))
    layout = load_task("fetch_cube").layout
    for step in range(3):
        assert (late[step][:, layout.state] == prompt[0][:, layout.state]).all()
    assert (late[3][:, layout.state] != prompt[0][:, layout.state]).any()
    assert late[2][0, layout.phase.stop - 1] == prompt[2][0, layout.phase.stop - 1]


def test_noise_has_its_deviation_on_lengths_and_leaves_the_rest_alone() -> None:
    _, clean = play(Conditions(arm=IDEAL))
    _, noisy = play(Conditions(arm=IDEAL, observation_noise=0.01))
    task = load_task("fetch_cube")
    change = (noisy[0] - clean[0])[0]
    lengths = np.array([unit == "m" for unit in task.state_space.units])
    assert np.flatnonzero(change[: len(lengths)]).tolist() == np.flatnonzero(lengths).tolist()
    assert 0.004 < change[: len(lengths)][lengths].std() < 0.02
    assert not change[task.layout.goal].any()


def test_a_trial_takes_no_more_steps_than_the_task_says(monkeypatch: pytest.MonkeyPatch) -> None:
    task = load_task("lift_cup")
    spec = deployment_of(task)
    short = replace(spec, trials=replace(spec.trials, max_steps=3))
    monkeypatch.setattr(type(task), "deployment", short)
    deployment = Deployment(task, task.script(), Conditions(arm=IDEAL))
    instance = spec.trials.own[0]
    rollout = deployment.play(instance, deployment.unit_design(instance), generator(0, "short"))
    assert rollout.steps == 3
    assert not rollout.success


def test_watching_a_trial_sees_its_start_and_every_step() -> None:
    task, moments = load_task("fetch_cube"), list[int]()
    deployment = Deployment(task, task.script(), Conditions(arm=IDEAL))

    def watch(episodes: Episodes) -> None:
        moments.append(int(episodes.elapsed[0]))

    rollout = deployment.play(NEAR_START, deployment.unit_design(NEAR_START), generator(0, "watch"), watch)
    assert moments == list(range(rollout.steps + 1))
