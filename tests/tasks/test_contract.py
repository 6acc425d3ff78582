"""What every task promises, checked for every task alike: same seed same rollout, bounds, ends, instances, cutout.

Shapes: `b` episodes played side by side, `T` control steps, `O` observation, `D` design, `C` control, `I` instance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
import pytest
from scipy import stats

from builders import offered
from codesign_bench.cell.axes import FINE_TUNING_INSTANCES
from codesign_bench.errors import UserError
from codesign_bench.method import Problem
from codesign_bench.registry import presented
from codesign_bench.task import Booleans, Floats, Singles, Slots, Task, load_task, task_names
from codesign_bench.task.behaviours import RandomBehaviour
from codesign_bench.task.episodes import TRADEOFF_TERM, Episodes, Tradeoff
from codesign_bench.task.play import Turn
from codesign_bench.task.play import play as library_play

pytestmark = pytest.mark.numeric

EPISODES = 4
STEPS = 60
"""Control steps of the rollouts that are compared; enough for tools to meet what they move."""
FRACTIONS = (0.2, 0.5, 0.8)
SAMPLES = 4_000


@pytest.fixture(params=task_names())
def task(request: pytest.FixtureRequest) -> Task:
    """Every task, one after the other."""
    return load_task(request.param)


@pytest.fixture
def cutout_task(task: Task) -> Task:
    """Every task that has a cutout region."""
    if not task.position_entries:
        pytest.skip("no goal or start of this task is a position")
    return task


@dataclass
class Script:
    """What is sent to a few episodes: instances (b, I), designs (b, D), controls (T, b, C)."""

    instances: Floats
    designs: Floats
    controls: Floats


@dataclass
class Recording:
    """What came back: observations (T + 2, b, O), rewards (T, b), both ends (T, b), each up to an episode's end."""

    observation: Singles
    reward: Floats
    terminated: Booleans
    truncated: Booleans


def script_for(task: Task, count: int = EPISODES, steps: int | None = None) -> Script:
    """Return a random script of `count` episodes whose controls persist for a while, so that tools travel."""
    rng = np.random.default_rng(5)
    steps = min(task.horizon, STEPS) if steps is None else steps
    held = rng.uniform(-1.0, 1.0, size=(steps // 10 + 1, count, task.control_space.size))
    return Script(
        task.sample_instances(rng, count),
        rng.uniform(-1.0, 1.0, size=(count, task.design_space.size)),
        np.repeat(held, 10, axis=0)[:steps],
    )


def play(episodes: Episodes, script: Script, slots: np.ndarray) -> Recording:
    """Play the script's episodes, the first in the first of `slots`; what follows an episode's end stays zero."""
    steps, count = script.controls.shape[:2]
    seen = np.zeros((steps + 2, count, episodes.layout.size), dtype=np.float32)
    recording = Recording(seen, np.zeros((steps, count)), *np.zeros((2, steps, count), dtype=bool))
    episodes.begin(slots, script.instances)
    seen[0] = episodes.observation[slots]
    episodes.design(slots, script.designs)
    seen[1] = episodes.observation[slots]
    active = np.arange(count)
    for step in range(steps):
        results = episodes.control(slots[active], script.controls[step, active])
        seen[step + 2, active] = episodes.observation[slots[active]]
        recording.reward[step, active], recording.terminated[step, active], recording.truncated[step, active] = results
        active = active[~(results[1] | results[2])]
        if not active.size:
            break
    return recording


def assert_equal(first: Recording, second: Recording) -> None:
    """Assert that two recordings are the same to the last bit."""
    for name, values in vars(first).items():
        np.testing.assert_array_equal(values, vars(second)[name], err_msg=name)


def one(script: Script, index: int) -> Script:
    """Return one episode of a script."""
    keep = slice(index, index + 1)
    return Script(script.instances[keep], script.designs[keep], script.controls[:, keep])


def corners(size: int) -> Floats:
    """Return all (2^size, size) corners of [-1, 1]^size."""
    return np.array(list(product((-1.0, 1.0), repeat=size)))


def test_a_rollout_is_the_same_alone_in_a_batch_and_in_another_slot_order(task: Task) -> None:
    script, slots = script_for(task), np.arange(EPISODES)
    together = play(Episodes(task, EPISODES), script, slots)
    wider = Episodes(task, EPISODES + 3)
    assert_equal(together, play(wider, script, slots[::-1] + 2))
    assert_equal(together, play(wider, script, slots))  # Slots that another episode has used before.
    for index in range(EPISODES):
        alone = play(Episodes(task, 1), one(script, index), np.array([0]))
        for name, values in vars(alone).items():
            np.testing.assert_array_equal(values[:, 0], vars(together)[name][:, index], err_msg=name)


def test_other_controls_and_designs_make_another_rollout(task: Task) -> None:
    script, slots = script_for(task), np.arange(EPISODES)
    before = play(Episodes(task, EPISODES), script, slots)
    for change in (
        Script(script.instances, -script.designs, script.controls),
        Script(script.instances, script.designs, -script.controls),
    ):
        assert not np.array_equal(before.observation, play(Episodes(task, EPISODES), change, slots).observation)


def test_observations_and_rewards_stay_in_their_bounds(task: Task) -> None:
    episodes = Episodes(task, EPISODES)
    recording = play(episodes, script_for(task, steps=task.horizon), np.arange(EPISODES))
    layout, bound = task.layout, 1.0 + 1e-5
    assert recording.observation.shape[2] == layout.size
    assert np.isfinite(recording.reward).all()
    seen = recording.observation[np.abs(recording.observation).any(axis=2)]
    for part, box in ((layout.state, task.state_space), (layout.goal, task.goal_space)):
        assert np.abs(box.to_unit(seen[:, part])).max(initial=0.0) <= bound
    assert np.abs(seen[:, layout.design]).max() <= 1.0
    assert (seen[:, layout.phase.start : layout.phase.start + 2].sum(axis=1) == 1.0).all()


def test_an_episode_ends_once_within_the_horizon(task: Task) -> None:
    script = script_for(task, steps=task.horizon + 1)
    recording = play(Episodes(task, EPISODES), script, np.arange(EPISODES))
    ends = recording.terminated.astype(int) + recording.truncated
    np.testing.assert_array_equal(ends.sum(axis=0), 1)
    assert not ends[task.horizon :].any()
    assert not recording.truncated[: task.horizon - 1].any()


def test_the_docstring_has_the_sections_that_a_reader_looks_for_and_states_the_sizes(task: Task) -> None:
    text = " ".join(str(type(task).__doc__).split())
    for section in ("Action space", "Observation", "Goal space", "Reward", "Starting state", "Episode end"):
        assert f" {section} " in text
    for part, space in {
        "Design": task.design_space,
        "Control": task.control_space,
        "State": task.state_space,
        "Goal": task.goal_space,
    }.items():
        assert f"{part}, {space.size}: " in text


def test_everything_in_a_scene_has_a_unit_and_a_source(task: Task) -> None:
    assert task.scene
    assert [name for name, constant in task.scene.items() if not (constant.unit and constant.source)] == []


def test_names_of_an_observation_are_different(task: Task) -> None:
    told = [*task.state_space.names, *task.goal_space.names, *task.design_space.names, *task.layout.PHASE_NAMES]
    assert len(set(told)) == len(told)


def test_spaces_agree_in_size(task: Task) -> None:
    designs = task.design_space.from_unit(script_for(task).designs)
    assert len(task.tool_graph.parameter_nodes) == task.design_space.size
    assert set(task.tool_graph.parameter_nodes) <= set(range(task.tool_graph.num_nodes))
    assert designs.shape == (EPISODES, task.design_space.size)
    assert task.control_period > 0.0
    for box in (task.design_space, task.control_space, task.instance_space, task.state_space):
        assert np.all(box.bounds[0] < box.bounds[1])


def test_evaluation_instances_are_fixed_different_and_inside_the_instance_space(task: Task) -> None:
    instances = task.evaluation_instances()
    np.testing.assert_array_equal(instances, load_task(task.name).evaluation_instances())
    assert instances.shape == (task.num_evaluation_instances, task.instance_space.size)
    assert len(np.unique(instances, axis=0)) == len(instances)
    assert np.abs(task.instance_space.to_unit(instances)).max() <= 1.0


def test_validation_instances_are_as_many_as_evaluation_instances_and_none_of_them(task: Task) -> None:
    validation, evaluation = task.validation_instances(), task.evaluation_instances()
    np.testing.assert_array_equal(validation, load_task(task.name).validation_instances())
    assert validation.shape == evaluation.shape
    together = np.concatenate([validation, evaluation])
    assert len(np.unique(together, axis=0)) == len(together)
    assert np.abs(task.instance_space.to_unit(validation)).max() <= 1.0


def test_instances_follow_their_generator(task: Task) -> None:
    first, again, other = (task.sample_instances(np.random.default_rng(seed), 8) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_actions_that_are_not_finite_are_refused(task: Task, bad: float) -> None:
    episodes, slots = Episodes(task, 1), np.array([0])
    script = one(script_for(task), 0)
    episodes.begin(slots, script.instances)
    with pytest.raises(ValueError, match="not finite"):
        episodes.design(slots, np.full_like(script.designs, bad))
    episodes.design(slots, script.designs)
    with pytest.raises(ValueError, match="not finite"):
        episodes.control(slots, np.full_like(script.controls[0], bad))


def test_refused_calls_change_nothing(task: Task) -> None:
    script, slots = script_for(task, steps=5), np.arange(EPISODES)
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

    assert_equal(play(Episodes(task, EPISODES), script, slots), play(Disturbed(task, EPISODES), script, slots))


def test_extreme_actions_act_like_the_bounds(task: Task) -> None:
    script, slots = script_for(task, steps=20), np.arange(EPISODES)
    wild = Script(script.instances, 100.0 * script.designs, 100.0 * script.controls)
    tame = Script(script.instances, np.clip(wild.designs, -1.0, 1.0), np.clip(wild.controls, -1.0, 1.0))
    assert_equal(play(Episodes(task, EPISODES), wild, slots), play(Episodes(task, EPISODES), tame, slots))


def test_a_task_has_a_region_and_a_cutout_if_and_only_if_it_names_a_position(task: Task) -> None:
    instances = task.evaluation_instances()
    if task.position_entries:
        assert len(task.position_entries) <= 2
        assert set(task.position_entries) <= set(task.instance_space.names)
        assert task.in_region(task.sample_instances(np.random.default_rng(1), SAMPLES)).all()
        assert not task.in_cutout(instances, 0.0).any()
    else:
        for refused in (lambda: task.in_region(instances), lambda: task.in_cutout(instances, 0.5)):
            with pytest.raises(UserError, match=f"'{task.name}' (are positions|has none)"):
                refused()


def test_fine_tuning_places_have_several_instances_all_out_of_the_training_region(task: Task) -> None:
    if type(task).fine_tuning_instances is Task.fine_tuning_instances:
        with pytest.raises(UserError, match=f"task '{task.name}' has no fine-tuning instances"):
            task.fine_tuning_instances()
    else:
        places = task.fine_tuning_instances()
        assert places.shape[1] >= FINE_TUNING_INSTANCES
        assert places.shape[2] == task.instance_space.size
        assert not task.in_region(places.reshape(-1, places.shape[2])).any()


def test_the_region_ends_where_instances_do(cutout_task: Task) -> None:
    low, high = cutout_task.instance_space.bounds
    index, beyond = cutout_task.position_index, 1e-6 * (high - low)
    for corner in (high + beyond, low - beyond):
        outside = 0.5 * (low + high)
        outside[index] = corner[index]
        assert not cutout_task.in_region(outside[None])[0]


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_training_never_sees_the_cutout_and_the_rest_as_before(cutout_task: Task, fraction: float) -> None:
    everywhere = cutout_task.sample_instances(np.random.default_rng(1), SAMPLES)
    kept = Problem(cutout_task, cutout=fraction).sample_instances(np.random.default_rng(2), SAMPLES)
    assert not cutout_task.in_cutout(kept, fraction).any()
    allowed = everywhere[~cutout_task.in_cutout(everywhere, fraction)]
    for column in range(kept.shape[1]):  # A difference that chance makes once in a thousand samples is refused.
        assert stats.ks_2samp(kept[:, column], allowed[:, column]).pvalue > 1e-3


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_the_cutout_is_the_stated_share_of_the_training_region(cutout_task: Task, fraction: float) -> None:
    instances = cutout_task.sample_instances(np.random.default_rng(3), SAMPLES)
    excluded = cutout_task.in_cutout(instances, fraction)
    deviation = np.sqrt(fraction * (1.0 - fraction) / SAMPLES)
    assert excluded.mean() == pytest.approx(fraction, abs=4.0 * deviation)
    assert (cutout_task.in_cutout(instances, min(1.0, fraction + 0.1)) >= excluded).all(), "a larger cutout holds it"


def test_material_and_effort_are_fractions_that_reach_one(task: Task) -> None:
    rng = np.random.default_rng(4)
    inside = rng.uniform(-1.0, 1.0, size=(SAMPLES, task.design_space.size))
    material = task.material(task.design_space.from_unit(np.vstack([inside, corners(task.design_space.size)])))
    controls = rng.uniform(-1.0, 1.0, size=(SAMPLES, task.control_space.size))
    effort = task.effort(np.vstack([controls, corners(task.control_space.size)]))
    for used in (material, effort):
        assert used.min() >= 0.0
        assert used.max() == pytest.approx(1.0)
    assert material.min() < 0.9
    assert task.effort(np.zeros((1, task.control_space.size)))[0] < 0.5


def test_the_tradeoff_reward_is_added_to_every_control_step(task: Task) -> None:
    script, slots = script_for(task), np.arange(EPISODES)
    plain = play(Episodes(task, EPISODES), script, slots)
    weighed = play(Episodes(task, EPISODES, Tradeoff(alpha=0.6, scale=0.5)), script, slots)
    material = task.material(task.design_space.from_unit(script.designs))
    running: Booleans = (
        np.cumsum(plain.terminated | plain.truncated, axis=0) - (plain.terminated | plain.truncated) == 0
    )
    for step in range(len(script.controls)):
        expected = 0.5 * (1.0 - 0.6 * material - 0.4 * task.effort(script.controls[step]))
        np.testing.assert_allclose((weighed.reward - plain.reward)[step], expected * running[step], atol=1e-9)


def steps_of(task: Task, episodes: Episodes) -> Iterator[Turn]:
    """Yield the control steps of a random behaviour, then those of the task's script."""
    instances = task.evaluation_instances()[:EPISODES]
    for behaviour in (RandomBehaviour(task, np.random.default_rng(6)), offered(task.script)):
        yield from (turn for turn in library_play(episodes, behaviour, instances) if turn.step > 0)


def test_the_terms_of_a_reward_are_those_declared_finite_and_add_up(task: Task) -> None:
    episodes = Episodes(task, EPISODES, Tradeoff(alpha=0.6, scale=0.5))
    for turn in steps_of(task, episodes):
        terms = [values[turn.slots] for values in episodes.reward_terms.values()]
        assert tuple(episodes.reward_terms) == (*task.reward_terms, TRADEOFF_TERM)
        assert np.isfinite(terms).all()
        np.testing.assert_array_equal(sum(terms[1:], start=terms[0]), turn.reward)


def test_success_is_that_all_declared_conditions_have_held_together_for_the_declared_steps(task: Task) -> None:
    episodes, held_for = Episodes(task, EPISODES), np.zeros(EPISODES, dtype=int)
    solved = 0
    for turn in steps_of(task, episodes):
        conditions = episodes.simulator.conditions
        assert tuple(conditions) == tuple(task.success_conditions)
        met = np.all([holds[turn.slots] for holds in conditions.values()], axis=0)
        held_for[turn.slots] = np.where(met, held_for[turn.slots] * (turn.step > 1) + 1, 0)
        np.testing.assert_array_equal(episodes.success(turn.slots), held_for[turn.slots] >= task.success_steps)
        assert task.failure_condition or not episodes.simulator.failure.any()
        solved += int(episodes.success(turn.slots).sum())
    assert solved > 0, "no episode was solved: the test shows little"


def test_a_new_episode_remembers_nothing_of_the_last(task: Task) -> None:
    episodes = Episodes(task, EPISODES)
    for _ in steps_of(task, episodes):
        pass
    simulator, slots = episodes.simulator, np.arange(1)
    episodes.begin(slots, task.evaluation_instances()[:1])
    told = [simulator.reward, *simulator.reward_terms.values(), simulator.success, simulator.failure]
    assert not any(values[0] for values in [*told, *simulator.conditions.values(), simulator.met_steps])


def test_a_tool_is_made_of_parts_that_its_design_changes(task: Task) -> None:
    low, high = task.design_space.bounds
    rng = np.random.default_rng(0)
    first, second = (offered(partial(task.tool_parts, design)) for design in task.design_space.sample(rng, 2))
    assert len(first) == len(second) == task.tool_graph.num_nodes
    assert first != second
    assert task.tool_parts(0.5 * (low + high)) == task.tool_parts(0.5 * (low + high))
    assert len({type(part) for part in first}) == 1


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
