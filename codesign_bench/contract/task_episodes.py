"""Checks of a task's episodes: that they end, stay in bounds and are the same however they are played.

Shapes: `b` episodes played side by side, `T` control steps, `O` observation.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env

from codesign_bench.contract.check import Fault, promised
from codesign_bench.contract.recording import EPISODES, Script, difference, random_script, record
from codesign_bench.task import Task
from codesign_bench.task.envs import RGB_ARRAY, environment_id, register_environments
from codesign_bench.task.episodes import Episodes

SIMULATOR = "codesign_bench.task.Simulator"
ROUNDING = 1e-5
"""Of a range: observations are in single precision."""


@promised("Its episodes can be played, and each ends once, within the horizon.", SIMULATOR, first=True)
def episodes_end(task: Task) -> Iterator[Fault]:
    """Yield episodes that end too early, too late, never or twice."""
    script = random_script(task, steps=task.horizon + 1)
    recording = record(Episodes(task, EPISODES), script, np.arange(EPISODES))
    ends = recording.terminated.astype(int) + recording.truncated
    for episode, count in enumerate(ends.sum(axis=0).tolist()):
        if count != 1:
            yield Fault(f"random episode {episode} ended {count} times", "one end")
    if ends[task.horizon :].any():
        yield Fault(f"an episode went on after {task.horizon} control steps", "its end there: `horizon`")
    if recording.truncated[: task.horizon - 1].any():
        yield Fault("the time limit ended an episode before the horizon", f"not before {task.horizon} control steps")


@promised(
    "Observations stay in the ranges of the spaces, and rewards are finite.", "codesign_bench.task.Task.state_space"
)
def observations_stay_in_bounds(task: Task) -> Iterator[Fault]:
    """Yield values outside of their ranges."""
    recording = record(Episodes(task, EPISODES), random_script(task, steps=task.horizon), np.arange(EPISODES))
    layout, bound = task.layout, 1.0 + ROUNDING
    if recording.observation.shape[2] != layout.size:
        yield Fault(f"observations of {recording.observation.shape[2]} entries", f"{layout.size}, from the spaces")
        return
    if not np.isfinite(recording.reward).all():
        yield Fault("a reward that is not finite", "finite rewards")
    seen = recording.observation[np.abs(recording.observation).any(axis=2)]
    for part, box in ((layout.state, task.state_space), (layout.goal, task.goal_space)):
        for column, name in enumerate(box.names):
            values = seen[:, part][:, column]
            low, high = box.low[column], box.high[column]
            if np.abs(2.0 * (values.astype(np.float64) - low) / (high - low) - 1.0).max(initial=0.0) > bound:
                yield Fault(
                    f"{name} from {values.min():g} to {values.max():g} {box.units[column]}", f"from {low:g} to {high:g}"
                )
    if np.abs(seen[:, layout.design]).max() > 1.0:
        yield Fault("a design in an observation is outside of [-1, 1]", "a normalised design")
    if not (seen[:, layout.phase.start : layout.phase.start + 2].sum(axis=1) == 1.0).all():
        yield Fault("an observation is of both phases or of none", "of one phase")


@promised(
    "State that leaves its space is rare enough not to hide what happens.", "codesign_bench.task.Task.state_space"
)
def states_stay_in_their_space(task: Task) -> Iterator[Fault]:
    """Yield entries of the state that random episodes leave clipped for most of their steps."""
    episodes, slots = Episodes(task, EPISODES), np.arange(EPISODES)
    script, beyond, steps = random_script(task), np.zeros(task.state_space.size), 0
    episodes.begin(slots, script.instances)
    episodes.design(slots, script.designs)
    for controls in script.controls:
        if not slots.size:
            break
        _, terminated, truncated = episodes.control(slots, controls[slots])
        outside = np.abs(task.state_space.to_unit(episodes.simulator.state[slots])) > 1.0 + ROUNDING
        beyond += outside.sum(axis=0)
        steps += len(slots)
        slots = slots[~(terminated | truncated)]
    for name, share in zip(task.state_space.names, beyond / max(steps, 1), strict=True):
        if share > 0.5:
            yield Fault(
                f"{name} is outside of its range in {share:.0%} of the steps of random episodes, where it is clipped",
                "a range that holds what usually happens",
            )


@promised("An episode is the same alone, in a batch, in another slot and in a used one.", SIMULATOR)
def episodes_do_not_depend_on_others(task: Task) -> Iterator[Fault]:
    """Yield the first difference of each kind."""
    script, slots = random_script(task), np.arange(EPISODES)
    together = record(Episodes(task, EPISODES), script, slots)
    wider = Episodes(task, EPISODES + 3)
    same = "the same to the last bit: a slot depends on the calls to it since `begin`, and on nothing else"
    if found := difference(task, together, record(wider, script, slots[::-1] + 2)):
        yield Fault(f"in other slots, {found}", same)
    if found := difference(task, together, record(wider, script, slots)):
        yield Fault(f"in slots that another episode has used, {found}", same)
    for index in range(EPISODES):
        alone = record(Episodes(task, 1), script.one(index), np.array([0]))
        if found := difference(task, together.one(index), alone):
            yield Fault(f"in a batch and alone, {found}", same)
            return


@promised("Other designs and other controls make another episode.", f"{SIMULATOR}.step")
def designs_and_controls_matter(task: Task) -> Iterator[Fault]:
    """Yield which of them changes nothing that is observed."""
    script, slots = random_script(task), np.arange(EPISODES)
    before = record(Episodes(task, EPISODES), script, slots)
    for what, change in (
        ("designs", Script(script.instances, -script.designs, script.controls)),
        ("controls", Script(script.instances, script.designs, -script.controls)),
    ):
        after = record(Episodes(task, EPISODES), change, slots)
        first, second = (played.observation[:, :, task.layout.state] for played in (before, after))
        if np.array_equal(first, second) and np.array_equal(before.reward, after.reward):
            yield Fault(f"opposite {what} changed no state and no reward", "that they change something")


@promised("Gymnasium's check_env has nothing to complain about.", "codesign_bench.task.envs.ToolEnv")
def gymnasium_agrees(task: Task) -> Iterator[Fault]:
    """Yield what Gymnasium warns of or refuses."""
    register_environments()
    mode = RGB_ARRAY if task.make_simulator(1).draws else None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_env(gymnasium.make(environment_id(task.name), render_mode=mode).unwrapped)
    except (AssertionError, Warning) as error:
        yield Fault(" ".join(str(error).split()), "no warning and no error")
