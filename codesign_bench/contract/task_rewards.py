"""Checks of a task's reward and success: the named terms, the named conditions, and that a new episode forgets both.

Shapes: `b` episodes played side by side.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from codesign_bench.contract.check import DoesWithoutError, Fault, promised
from codesign_bench.contract.recording import EPISODES
from codesign_bench.errors import UserError
from codesign_bench.task import Behaviour, Task
from codesign_bench.task.behaviours import RandomBehaviour
from codesign_bench.task.episodes import TASK_TERM, TRADEOFF_TERM, Episodes, Tradeoff
from codesign_bench.task.play import Turn, play

TASK, SIMULATOR = "codesign_bench.task.Task", "codesign_bench.task.Simulator"


def control_steps(task: Task, episodes: Episodes) -> Iterator[Turn]:
    """Yield the control steps of a random behaviour, then those of the task's script if it has one."""
    instances = task.evaluation_instances()[:EPISODES]
    behaviours: list[Behaviour] = [RandomBehaviour(task, np.random.default_rng(6))]
    with suppress(UserError):
        behaviours.append(task.script())
    for behaviour in behaviours:
        yield from (turn for turn in play(episodes, behaviour, instances) if turn.step > 0)


@promised("The reward is the sum of the terms that the task declares.", f"{TASK}.reward_terms")
def reward_is_the_sum_of_its_terms(task: Task) -> Iterator[Fault]:
    """Yield terms that are others, not finite, or do not add up."""
    episodes = Episodes(task, len(task.evaluation_instances()[:EPISODES]), Tradeoff(alpha=0.6, scale=0.5))
    declared = tuple(task.reward_terms) or (TASK_TERM,)
    for turn in control_steps(task, episodes):
        terms = [values[turn.slots] for values in episodes.reward_terms.values()]
        given = tuple(name for name in episodes.reward_terms if name != TRADEOFF_TERM)
        if given != declared:
            yield Fault(
                f"`set_reward` is given {', '.join(given)}",
                f"the terms that `reward_terms` declares, in its order: {', '.join(declared)}",
            )
            return
        if not np.isfinite(terms).all():
            yield Fault(f"a term is not finite after control step {turn.step}", "finite terms")
            return
        if not np.array_equal(sum(terms[1:], start=terms[0]), turn.reward):
            yield Fault(
                f"the terms do not add up to the reward of control step {turn.step}", "their sum, in their order"
            )
            return


@promised(
    "Success means that all declared conditions have held together for the declared steps.",
    f"{TASK}.success_conditions",
)
def success_is_what_is_declared(task: Task) -> Iterator[Fault]:
    """Yield conditions that are others, and successes that they do not explain."""
    count = len(task.evaluation_instances()[:EPISODES])
    episodes, held_for = Episodes(task, count), np.zeros(count, dtype=int)
    for turn in control_steps(task, episodes):
        conditions = episodes.simulator.conditions
        if tuple(conditions) != tuple(task.success_conditions):
            yield Fault(
                f"`set_success` is given: {', '.join(conditions) or 'nothing'}",
                f"what `success_conditions` declares, in its order: {', '.join(task.success_conditions) or 'nothing'}",
            )
            return
        if not conditions:
            raise DoesWithoutError("it declares no `success_conditions`")
        met = np.all([holds[turn.slots] for holds in conditions.values()], axis=0)
        held_for[turn.slots] = np.where(met, held_for[turn.slots] * (turn.step > 1) + 1, 0)
        if not np.array_equal(episodes.success(turn.slots), held_for[turn.slots] >= task.success_steps):
            yield Fault(
                f"after control step {turn.step}, success is not that all conditions have held for "
                f"{task.success_steps} steps",
                "`set_success` in every step, with `steps=success_steps`",
            )
            return
        if not task.failure_condition and episodes.simulator.failure.any():
            yield Fault("an episode failed, and `failure_condition` is empty", "when episodes fail, in words")
            return


@promised("A new episode remembers nothing of the last: no reward, no success.", f"{SIMULATOR}.forget")
def new_episodes_forget(task: Task) -> Iterator[Fault]:
    """Yield what is left of the last episode."""
    episodes = Episodes(task, len(task.evaluation_instances()[:EPISODES]))
    for _ in control_steps(task, episodes):
        pass
    simulator, slots = episodes.simulator, np.arange(1)
    episodes.begin(slots, task.evaluation_instances()[:1])
    left = {
        "reward": simulator.reward,
        **simulator.reward_terms,
        "success": simulator.success,
        "failure": simulator.failure,
        **simulator.conditions,
        "met_steps": simulator.met_steps,
    }
    if kept := [name for name, values in left.items() if values[0]]:
        yield Fault(f"after `begin`, not zero: {', '.join(kept)}", "`self.forget(slots)` in `begin`")
