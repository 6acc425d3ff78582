"""Collect a batch: split its slots into groups and play the groups, in this process or in parallel processes.

Shapes: `S` slots of a batch.

Each group has its own random stream and its own batched calls of the explorer. The number of groups depends only on the
number of slots, so results do not depend on the number of processes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from codesign_bench.config.run_settings import OVERSHOOT
from codesign_bench.learning.explorer import Explorer
from codesign_bench.learning.rollout import Collector
from codesign_bench.learning.trajectories import Trajectories, joined
from codesign_bench.method import Problem
from codesign_bench.seeding import Streams
from codesign_bench.task.simulators import Simulators

GROUP_SLOTS = 96
"""Fewest slots of a group, unless the batch has fewer: smaller calls of the policy cost more per step."""


@dataclass(frozen=True)
class Group:
    """One group of slots of a batch."""

    steps: int
    """Total environment steps of its slots."""
    slots: int
    """S of the group"""
    rng: np.random.Generator
    first_slot: int = 0
    """The index of its first slot in the batch."""
    most: int | None = None
    """Environment steps that its slots' further episodes must not exceed; None: no limit."""


@dataclass(frozen=True)
class _Play:
    """A group with all that another process needs to play it."""

    problem: Problem
    explorer: Explorer
    group: Group

    @staticmethod
    def run(simulators: Simulators, play: _Play) -> tuple[Trajectories, Any]:
        """Play the group; return what happened and the state of its generator afterwards."""
        group, collector = play.group, Collector(play.problem, simulators)
        played = collector.collect(play.explorer, group.steps, group.slots, group.rng, group.first_slot, group.most)
        return played, group.rng.bit_generator.state


class BatchCollector:
    """Collects the batches of one learner; random numbers come from the streams `rollout`, `rollout 1` and so on."""

    def __init__(self, problem: Problem, streams: Streams) -> None:
        self.problem, self.streams = problem, streams

    def use_cores(self, count: int) -> None:
        """Play groups in up to `count` processes; results do not change."""
        self.problem.simulators.use_cores(count)

    def collect(
        self, explorer: Explorer, steps: int, num_slots: int | None = None, most: int | None = None
    ) -> Trajectories:
        """Return about `steps` environment steps of whole episodes.

        A slot plays episodes until it has taken its share of the steps, so a batch may be up to twice as long as
        wanted; with `most`, no further episode begins that could exceed it.

        Args:
            explorer: chooses designs and controls.
            steps: environment steps wanted; the last episode of every slot is finished.
            num_slots: S, the number of parallel episodes; None: one full-length episode per slot.
            most: environment steps after which no episode is begun, except the first of every slot; None: no limit.
        """
        groups = self._groups(steps, num_slots or slots_for(steps, self.problem.task.horizon + 1), most)
        results = self.problem.simulators.share(_Play.run, [_Play(self.problem, explorer, group) for group in groups])
        # Another process advances a copy of the generator; the next batch must not repeat its random numbers.
        for group, (_, advanced) in zip(groups, results, strict=True):
            group.rng.bit_generator.state = advanced
        return joined([played for played, _ in results])

    def _groups(self, steps: int, num_slots: int, most: int | None) -> list[Group]:
        groups, first = [], 0
        for index, size in enumerate(group_sizes(num_slots, self.problem.task.max_slots)):
            stream = "rollout" if index == 0 else f"rollout {index}"
            limit = None if most is None else most * size // num_slots
            groups.append(Group(steps * size // num_slots, size, self.streams[stream], first, limit))
            first += size
        return groups


def most_steps(taken: int, remaining: int) -> int:
    """Return the longest that the next batch may be, from the steps that a cell has taken and those in its budget."""
    return remaining + int(OVERSHOOT * (taken + remaining))


def slots_for(steps: int, episode_steps: int, most: int | None = None) -> int:
    """Return the number of slots, at most `most`, whose episodes of `episode_steps` steps fill `steps` steps."""
    wanted = max(1, round(steps / episode_steps))
    return wanted if most is None else min(wanted, most)


def group_sizes(num_slots: int, max_slots: int) -> list[int]:
    """Split `num_slots` slots into one group or an even number of groups of near-equal size; return the sizes.

    No group has more than `max_slots`, the limit of the task's simulators.
    """
    # An even number of near-equal groups keeps two processes busy until the end of the batch.
    pairs = num_slots // (2 * GROUP_SLOTS)
    if num_slots > max_slots:
        pairs = max(pairs, -(-num_slots // (2 * max_slots)))
    count = 2 * pairs or 1
    return [len(part) for part in np.array_split(np.arange(num_slots), count)]
