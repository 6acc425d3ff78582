"""Policies on a simulated arm: what is played, what is written, and that the ideal arm is the task's own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from codesign_bench import load_task
from codesign_bench.cli import main
from codesign_bench.deployment.conditions import TRIAL, Conditions, Physics
from codesign_bench.deployment.deploy import Order, deploy
from codesign_bench.deployment.protocol import grid_trials, own_trials
from codesign_bench.deployment.rollout import Deployment
from codesign_bench.deployment.tables import load_deployment, row, summarise
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.seeding import generator
from codesign_bench.storage.policies import policy_and_task
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


def test_the_papers_real_starts_are_turned_by_half_a_turn_into_our_frame() -> None:
    trials = deployment_of(load_task("fetch_cube")).trials
    assert trials.own.tolist() == [[0.110, 0.803], [0.339, 0.588], [-0.155, 0.731], [-0.211, 0.633]]
    assert len(trials.own) == len(deployment_of(load_task("lift_cup")).trials.own) == 4


def test_the_grid_is_the_papers_with_the_farthest_row_first() -> None:
    grid = deployment_of(load_task("fetch_cube")).trials.grid
    assert grid.shape == (3, 4, 2)
    assert np.diff(grid[:, 0, 1]) == pytest.approx([-0.06, -0.06])
    assert np.diff(grid[0, :, 0]) == pytest.approx([0.28533] * 3, abs=1e-5)
    assert grid.mean(axis=(0, 1)) == pytest.approx([0.0, 0.65])


def test_the_protocol_has_five_trials_of_each_tool_and_twelve_starts() -> None:
    trials = deployment_of(load_task("fetch_cube")).trials
    assert len(list(own_trials(trials, (1, 2, 3, 4), trials.trials_per_tool))) == 20
    planned = list(grid_trials(trials, (1, 2, 3, 4)))
    assert len({trial.name for trial in planned}) == 48
    assert list(grid_trials(deployment_of(load_task("lift_cup")).trials, (1, 2))) == []


@pytest.mark.parametrize("name", TASKS)
def test_with_the_ideal_arm_and_nothing_changed_deployment_is_the_task_itself(name: str) -> None:
    task = load_task(name)
    instance = deployment_of(task).trials.own[3]
    expected = evaluate(task, task.script(), instances=instance[None])
    rollout, _ = play(Conditions(arm=IDEAL), instance, name)
    assert rollout.success == expected.successes[0]
    assert rollout.steps == expected.lengths[0]
    assert rollout.outcome == expected.outcomes[0], "to the last bit: the physics are the same"


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


def test_every_trial_draws_its_own_physics_and_the_same_seed_draws_it_again() -> None:
    first, again, other = (Physics.draw(TRIAL, generator(seed, "trial")) for seed in (0, 0, 1))
    assert first == again != other
    many = [Physics.draw(TRIAL, generator(seed, "trial")).friction for seed in range(200)]
    assert 0.8 <= min(many) < 0.82
    assert 1.18 < max(many) <= 1.2


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"arm": "crane"}, "unknown arm 'crane'; choose from: panda, ideal"),
        ({"observation_noise": -1.0}, "--observation-noise"),
        ({"latency": -1}, "--latency"),
        ({"friction": 1.0}, "--friction"),
        ({"mass": float("nan")}, "--mass"),
    ],
)
def test_conditions_that_mean_nothing_are_refused(change: dict[str, Any], told: str) -> None:
    with pytest.raises(UserError, match=told):
        replace(Conditions(), **change).check()


def test_a_task_without_an_arm_names_those_that_have_one(tmp_path: Path) -> None:
    task = load_task("push")
    with pytest.raises(UserError, match="task 'push' has no deployment; choose from: fetch_cube, lift_cup"):
        deploy(task, task.script(), Order(Conditions()), tmp_path, print)


def test_trials_are_written_with_their_incidents_and_a_picture_of_each(tmp_path: Path) -> None:
    task, told = load_task("fetch_cube"), list[str]()
    deploy(task, task.script(), Order(TRIAL, tools=(4,)), tmp_path, told.append, "a script")
    folder = tmp_path / "deployment" / "fetch_cube"
    table = pd.read_csv(folder / "trials.csv")
    assert table[["kind", "tool", "trial", "row", "column"]].to_numpy().tolist() == [["own", 4, 1, -1, -1]]
    assert table["instance_cube_start_x"].tolist() == [-0.211]
    assert table["tracking_error_mean_mm"].item() > 0.0
    assert {"unreachable_steps", "joint_limit_steps", "self_collision_steps"} <= set(table.columns)
    summary = json.loads((folder / "trials.json").read_text())
    assert summary["policy"] == "a script"
    assert summary["conditions"]["latency"] == TRIAL.latency
    assert summary["designs"]["4"]["link_1_length"] > 0.0
    assert summary["tools"][0]["trials"] == 1
    assert told[0].startswith("own-tool-4-trial-1: ")
    picture = folder / "rollouts" / "own-tool-4-trial-1.gif"
    assert picture.stat().st_size < 1_000_000
    with Image.open(picture) as film:
        assert film.n_frames > 3  # type: ignore[attr-defined]
    with pytest.raises(UserError, match="--tool 5: there is no such tool; choose from 1 to 4"):
        deploy(task, task.script(), Order(TRIAL, tools=(5,)), tmp_path, told.append)


def test_a_cube_that_ends_within_5_cm_is_nearly_fetched() -> None:
    task = load_task("fetch_cube")
    rollout, _ = play(Conditions(arm=IDEAL))
    settings = deployment_of(task).trials
    ends = [replace(rollout, success=outcome < 0.5, outcome=outcome) for outcome in (0.49, 0.54, 0.56)]
    rows = [row(task, settings, NEAR_START, end, kind="own", tool=1) for end in ends]
    assert [(entry["success"], entry["near"]) for entry in rows] == [(1, 0), (0, 1), (0, 0)]
    (summary,) = summarise(rows)
    assert (summary["trials"], summary["successes"], summary["near"]) == (3, 1, 1)


def test_a_policy_of_another_task_is_refused() -> None:
    with pytest.raises(UserError, match="is not a cell folder"):
        policy_and_task(Path("nowhere"), "fetch_cube")


def test_without_trials_the_user_is_told_how_to_make_them(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="codesign-bench deploy --policy CELL --protocol"):
        load_deployment(tmp_path)


def test_the_command_refuses_what_does_not_go_together(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["deploy", "--policy", "cell", "--protocol", "--trials", "2"]) == 2
    assert "--protocol sets tools and trials itself" in capsys.readouterr().err
    assert main(["deploy", "--policy", "nowhere"]) == 2
    assert "'nowhere' is not a cell folder" in capsys.readouterr().err


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
