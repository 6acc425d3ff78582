"""Evaluate a policy on a task's fixed evaluation instances, acting with its means.

Shapes: `N` evaluation instances, `I` instance, `D` design, `H` horizon, `C` control.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from codesign_bench.task import Behaviour, Booleans, Floats, Singles, Task
from codesign_bench.task.episodes import Episodes, Tradeoff, portions
from codesign_bench.task.play import Observe, play
from codesign_bench.task.simulators import Simulators


@dataclass(frozen=True)
class Evaluation:
    """One episode per evaluation instance."""

    instances: Floats
    """(N, I) in the instance space's units."""
    designs: Floats
    """(N, D) in the design space's units."""
    returns: Floats
    """(N,) undiscounted returns, including the trade-off reward."""
    successes: Booleans
    """(N,)"""
    lengths: Floats
    """(N,) control steps."""
    material: Floats
    """(N,) d_used / d_max of equation 1."""
    outcomes: Floats
    """(N,) the task's outcome at the end."""
    effort: Floats
    """(N,) mean c_used / c_max of equation 1 over the episode."""
    unit_designs: Singles
    """(N, D) the designs in [-1, 1], as they were played."""
    controls: Floats
    """(N, H, C) in [-1, 1]; zero after the end of an episode."""

    @property
    def summary(self) -> dict[str, float]:
        """The evaluation's columns of a learning curve; `return_se` is the standard error over instances."""
        count = len(self.returns)
        spread = float(self.returns.std(ddof=1) / np.sqrt(count)) if count > 1 else 0.0
        return {
            "return_mean": float(self.returns.mean()),
            "return_se": spread,
            "success_rate": float(self.successes.mean()),
            "episode_length": float(self.lengths.mean()),
        }


def evaluate(
    task: Task,
    policy: Behaviour,
    tradeoff: Tradeoff | None = None,
    instances: Floats | None = None,
    simulators: Simulators | None = None,
    observe: Observe | None = None,
) -> Evaluation:
    """Run one episode of `policy` on each of `instances`.

    Args:
        task: the task.
        policy: designs and acts.
        tradeoff: added to the task's reward if given.
        instances: (N, I) in the instance space's units; None: the task's fixed evaluation instances.
        simulators: lend the simulator, and share the work if they use several cores; None: new ones, on one core.
        observe: see `play`; the slots that it gets are those of one of the `portions` of the instances. They are
            then played in this process.
    """
    instances = task.evaluation_instances() if instances is None else instances
    shared = Simulators(task) if simulators is None else simulators
    plays = [_Play(policy, tradeoff, instances[part], observe) for part in portions(len(instances), task)]
    parts = shared.share(_Play.run, plays) if observe is None else [_Play.run(shared, play) for play in plays]
    return Evaluation(
        **{field.name: np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Evaluation)}
    )


@dataclass(frozen=True)
class _Play:
    """Some of the instances, with all that another process needs to play them."""

    policy: Behaviour
    tradeoff: Tradeoff | None
    instances: Floats
    observe: Observe | None

    @staticmethod
    def run(simulators: Simulators, play: _Play) -> Evaluation:
        """Run one episode on each of the instances."""
        count = len(play.instances)
        with simulators.lend(count) as simulator:
            episodes = Episodes(simulators.task, count, play.tradeoff, simulator)
            return _play(episodes, play.policy, play.instances, play.observe)


def _play(episodes: Episodes, policy: Behaviour, instances: Floats, observe: Observe | None) -> Evaluation:
    """Run one episode on each of `instances` (N, I) in the first slots of `episodes`."""
    task, count = episodes.task, len(instances)
    returns, lengths, effort = np.zeros(count), np.zeros(count), np.zeros(count)
    controls = np.zeros((count, task.horizon, task.control_space.size))
    for turn in play(episodes, policy, instances, observe):
        if turn.step:
            returns[turn.slots] += turn.reward
            lengths[turn.slots] += 1
            effort[turn.slots] += task.effort(turn.controls)
            controls[turn.slots, turn.step - 1] = turn.controls
    return Evaluation(
        instances=instances,
        designs=episodes.designs[:count],
        returns=returns,
        successes=episodes.success(np.arange(count)).copy(),
        lengths=lengths,
        outcomes=episodes.simulator.outcome[:count].copy(),
        material=task.material(episodes.designs[:count]),
        effort=effort / np.maximum(lengths, 1.0),
        unit_designs=episodes.observation[:count, episodes.layout.design].copy(),
        controls=controls,
    )


def rows(task: Task, evaluation: Evaluation, cutout: float = 0.0) -> Iterator[dict[str, Any]]:
    """Yield one table row per instance: instance and design by entry name, and the outcome.

    With a `cutout`, `in_cutout` marks the held-out instances.
    """
    unseen = None if cutout == 0.0 else task.in_cutout(evaluation.instances, cutout)
    for index in range(len(evaluation.returns)):
        yield {
            **_named("instance", task.instance_space.names, evaluation.instances[index]),
            **_named("design", task.design_space.names, evaluation.designs[index]),
            "return": float(evaluation.returns[index]),
            "success": int(evaluation.successes[index]),
            "episode_length": int(evaluation.lengths[index]),
            "material": float(evaluation.material[index]),
            "effort": float(evaluation.effort[index]),
            **({} if unseen is None else {"in_cutout": int(unseen[index])}),
        }


def _named(kind: str, names: tuple[str, ...], values: Floats) -> dict[str, float]:
    return {f"{kind}_{name}": float(value) for name, value in zip(names, values, strict=True)}
