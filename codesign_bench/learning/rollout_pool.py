"""Play the groups of a batch in processes of their own; the numbers are those of playing them one after the other.

Shapes: `S` slots of a group, `D` design.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch

from codesign_bench.learning.actor import Actor
from codesign_bench.learning.rollout import Collector, Trajectories
from codesign_bench.method import Problem
from codesign_bench.processes import end_with
from codesign_bench.task import Singles

_collector: Collector | None = None
"""The collector of a worker process."""


@dataclass(frozen=True)
class Group:
    """What one group of slots shall play."""

    steps: int
    """Environment steps of all its slots together."""
    slots: int
    rng: np.random.Generator
    given_designs: Singles | None = None
    """(S, D) designs to use instead of the actor's."""

    def collect(self, collector: Collector, actor: Actor) -> Trajectories:
        """Play the group with `collector`; its generator moves on."""
        return collector.collect(actor, self.steps, self.slots, self.rng, self.given_designs)


class RolloutPool:
    """Worker processes with simulators of their own, started when first needed; they end with this process."""

    def __init__(self, problem: Problem, workers: int) -> None:
        self._pool = ProcessPoolExecutor(
            workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_prepare,
            initargs=(problem, os.getpid()),
        )

    def collect(self, actor: Actor, groups: Sequence[Group]) -> list[Trajectories]:
        """Play `groups`; their generators move on as if they had been played here."""
        results = list(self._pool.map(_play, [actor] * len(groups), groups))
        for group, (_, rng) in zip(groups, results, strict=True):
            group.rng.bit_generator.state = rng.bit_generator.state
        return [batch for batch, _ in results]


def _prepare(problem: Problem, parent: int) -> None:
    global _collector  # a worker process has one
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides.
    end_with(parent)
    torch.set_num_threads(1)
    _collector = Collector(problem)


def _play(actor: Actor, group: Group) -> tuple[Trajectories, np.random.Generator]:
    assert _collector is not None, "a worker is prepared before it plays"
    return group.collect(_collector, actor), group.rng
