"""What every task promises: the contract that `codesign-bench check` asks of any task, and what episodes add to it.

Shapes: `b` episodes played side by side, `T` control steps, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

import numpy as np
import pytest

from builders import assert_kept
from codesign_bench.contract import TASK_CHECKS, Check, ask, examine_task
from codesign_bench.contract.recording import EPISODES, Recording, Script, random_script, record
from codesign_bench.contract.task_rewards import control_steps
from codesign_bench.errors import UserError
from codesign_bench.registry import presented
from codesign_bench.task import Booleans, Floats, Slots, Task, load_task, task_names
from codesign_bench.task.episodes import Episodes, Tradeoff

pytestmark = pytest.mark.numeric


@pytest.fixture(params=task_names())
def task(request: pytest.FixtureRequest) -> Task:
    """Every task, one after the other."""
    return load_task(request.param)


def assert_equal(first: Recording, second: Recording) -> None:
    """Assert that two recordings are the same to the last bit."""
    for name, values in vars(first).items():
        np.testing.assert_array_equal(values, vars(second)[name], err_msg=name)


@pytest.mark.parametrize("name", task_names())
def test_a_task_can_be_loaded(name: str) -> None:
    assert_kept(next(examine_task(name)))


@pytest.mark.parametrize("check", TASK_CHECKS, ids=lambda check: check.name)
@pytest.mark.parametrize("name", task_names())
def test_a_task_keeps_the_contract(name: str, check: Check[Task]) -> None:
    task = load_task(name)
    assert_kept(ask(check, task, type(task)))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_actions_that_are_not_finite_are_refused(task: Task, bad: float) -> None:
    episodes, slots = Episodes(task, 1), np.array([0])
    script = random_script(task).one(0)
    episodes.begin(slots, script.instances)
    with pytest.raises(ValueError, match="not finite"):
        episodes.design(slots, np.full_like(script.designs, bad))
    episodes.design(slots, script.designs)
    with pytest.raises(ValueError, match="not finite"):
        episodes.control(slots, np.full_like(script.controls[0], bad))


def test_refused_calls_change_nothing(task: Task) -> None:
    script, slots = random_script(task, steps=5), np.arange(EPISODES)
    wrong = [np.nan, np.inf, -np.inf]

    class Disturbed(Episodes):
        """Episodes of which every call comes after calls of its kind that are refused."""

        def begin(self, slots: Slots, instances: Floats) -> None:
            """Begin, at last."""
            others = [np.append(slots[1:], -1), np.append(slots[1:], self.num_slots), slots[[0] * len(slots)]]
            for bad, where in [*((bad, slots) for bad in worse(instances)), *((instances, other) for other in others)]:
                with pytest.raises(ValueError, match=r"instance|slots"):
                    super().begin(where, bad)
            super().begin(slots, instances)

        def design(self, slots: Slots, unit_designs: Floats) -> None:
            """Design, at last."""
            for bad in worse(unit_designs):
                with pytest.raises(ValueError, match="design"):
                    super().design(slots, bad)
            super().design(slots, unit_designs)

        def control(self, slots: Slots, controls: Floats) -> tuple[Floats, Booleans, Booleans]:
            """Control, at last."""
            for bad in worse(controls):
                with pytest.raises(ValueError, match="control"):
                    super().control(slots, bad)
            return super().control(slots, controls)

    def worse(values: Floats) -> list[Floats]:
        """Return values of wrong shapes, and with values that are not finite in the last row."""
        shapes = [values[0], values[:1, :1], values[:, :1], values[:-1], np.vstack([values, values]), values[None]]
        last = np.arange(len(values)) == len(values) - 1
        fitting = [np.where(last[:, None], bad, values) for bad in wrong]
        return [*(part for part in shapes if part.shape != values.shape), *fitting]

    assert_equal(record(Episodes(task, EPISODES), script, slots), record(Disturbed(task, EPISODES), script, slots))


def test_extreme_actions_act_like_the_bounds(task: Task) -> None:
    script, slots = random_script(task, steps=20), np.arange(EPISODES)
    wild = Script(script.instances, 100.0 * script.designs, 100.0 * script.controls)
    tame = Script(script.instances, np.clip(wild.designs, -1.0, 1.0), np.clip(wild.controls, -1.0, 1.0))
    assert_equal(record(Episodes(task, EPISODES), wild, slots), record(Episodes(task, EPISODES), tame, slots))


def test_the_tradeoff_reward_is_added_to_every_control_step(task: Task) -> None:
    script, slots = random_script(task), np.arange(EPISODES)
    plain = record(Episodes(task, EPISODES), script, slots)
    weighed = record(Episodes(task, EPISODES, Tradeoff(alpha=0.6, scale=0.5)), script, slots)
    material = task.material(task.design_space.from_unit(script.designs))
    running: Booleans = (
        np.cumsum(plain.terminated | plain.truncated, axis=0) - (plain.terminated | plain.truncated) == 0
    )
    for step in range(len(script.controls)):
        expected = 0.5 * (1.0 - 0.6 * material - 0.4 * task.effort(script.controls[step]))
        np.testing.assert_allclose((weighed.reward - plain.reward)[step], expected * running[step], atol=1e-9)


def test_a_task_without_fine_tuning_instances_says_so(task: Task) -> None:
    if type(task).fine_tuning_instances is Task.fine_tuning_instances:
        with pytest.raises(UserError, match=f"task '{task.name}' has no fine-tuning instances"):
            task.fine_tuning_instances()


@pytest.mark.parametrize("name", presented("tasks"))
def test_what_is_asked_of_success_is_asked_of_a_task_that_is_solved(name: str) -> None:
    task = load_task(name)
    episodes = Episodes(task, EPISODES)
    assert sum(int(episodes.success(turn.slots).sum()) for turn in control_steps(task, episodes)) > 0


@pytest.mark.parametrize("name", presented("tasks"))
def test_a_presented_task_does_without_nothing(name: str) -> None:
    task = load_task(name)
    episodes, slots = Episodes(task, 1), np.arange(1)
    episodes.begin(slots, task.evaluation_instances()[:1])
    episodes.design(slots, np.zeros((1, task.design_space.size)))
    assert task.script()
    assert task.tool_parts(task.design_space.bounds[0])
    assert task.soundness
    assert task.outcome
    assert task.success_conditions
    assert task.reward_terms
    assert episodes.simulator.inspect(0).contained
    assert episodes.simulator.tool_shapes(0)
    assert episodes.simulator.draws
    assert episodes.simulator.render(0).size
