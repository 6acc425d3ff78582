"""Checks of a task's script, the designer and controller that are written by hand.

Shapes: `b` episodes side by side, `D` design, `C` control.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from codesign_bench.contract.check import DoesWithoutError, Fault, promised
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import Behaviour, Task
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import Episodes, portions

EPISODES = 12
BATCH = 3
SCRIPT = "codesign_bench.task.Task.script"


def script_of(task: Task) -> Behaviour:
    """Return the task's script.

    Raises:
        DoesWithoutError: it has none.
    """
    try:
        return task.script()
    except UserError as error:
        raise DoesWithoutError("it has no script") from error


@promised("The script solves some instances, and other tools change what it reaches.", SCRIPT)
def script_solves_some(task: Task) -> Iterator[Fault]:
    """Yield where it does not."""
    script = script_of(task)
    instances = task.evaluation_instances()[:EPISODES]
    own = evaluate(task, script, instances=instances)
    if not own.successes.any():
        yield Fault(f"it solves none of {len(instances)} evaluation instances", "some of them")
    else:
        least, most = own.returns[own.successes].min(), own.returns[~own.successes].max(initial=-np.inf)
        if least <= most - 1.0:
            yield Fault(
                f"an unsolved episode returns {most:.3g}, and a solved one {least:.3g}",
                "a reward that does not pay more, by 1 or above, for not solving the task",
            )
    inside = np.random.default_rng(1).uniform(-1.0, 1.0, size=(EPISODES, task.design_space.size))
    tools = np.where(np.arange(EPISODES)[:, None] % 2 == 0, np.sign(inside), inside)  # Half of them at corners.
    reached: list[float] = []
    for part in portions(EPISODES, task):
        same = np.repeat(instances[:1], len(part), axis=0)
        others = evaluate(task, GivenDesigns(tools[part], script), instances=same)
        reached += (others.returns if task.outcome is None else others.outcomes).tolist()
    if len(set(reached)) == 1:
        yield Fault(f"{EPISODES} random tools all reach {reached[0]:.3g}", "a task in which the tool matters")


@promised("The script is a function of the observation, of one or of many.", SCRIPT)
def script_is_a_function(task: Task) -> Iterator[Fault]:
    """Yield where it is not."""
    script, slots = script_of(task), np.arange(BATCH)
    episodes = Episodes(task, BATCH)
    episodes.begin(slots, task.sample_instances(np.random.default_rng(7), BATCH))
    designs = script.design(episodes.observation)
    yield from _unlike("design", designs, script.design(episodes.observation[1]), task.design_space.size)
    episodes.design(slots, np.asarray(designs, dtype=np.float64))
    controls = script.act(episodes.observation)
    yield from _unlike("control", controls, script.act(episodes.observation[1]), task.control_space.size)


def _unlike(what: str, many: np.ndarray, one: np.ndarray, size: int) -> Iterator[Fault]:
    if many.shape != (BATCH, size):
        yield Fault(f"a {what} of shape {many.shape} for {BATCH} observations", f"{(BATCH, size)}")
    elif not np.array_equal(one, many[1]):
        yield Fault(f"the {what} for one observation differs from that for the same one among {BATCH}", "the same")
    elif np.abs(many).max() > 1.0:
        yield Fault(f"a {what} of {np.abs(many).max():.3g}", "values in [-1, 1]")
