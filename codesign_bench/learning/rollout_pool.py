"""Play the groups of a batch in separate processes, with the same results as one group after the other.

Shapes: `S` slots of a group.
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

from codesign_bench.learning.explorer import Explorer
from codesign_bench.learning.rollout import Collector
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.method import Problem
from codesign_bench.processes import end_with

_collector: Collector | None = None
"""The collector of a worker process."""


@dataclass(frozen=True)
class Group:
    """One group of slots of a batch."""

    steps: int
    """Total environment steps of its slots."""
    slots: int
    """S"""
    rng: np.random.Generator
    first_slot: int = 0
    """The index of its first slot in the batch."""
    most: int | None = None
    """Environment steps that its slots' further episodes must not exceed; None: no limit."""

    def collect(self, collector: Collector, explorer: Explorer) -> Trajectories:
        """Play the group with `collector`; this advances the generator."""
        return collector.collect(explorer, self.steps, self.slots, self.rng, self.first_slot, self.most)


class RolloutPool:
    """Worker processes with one simulator each, started on first use; they end with this process."""

    def __init__(self, problem: Problem, workers: int) -> None:
        self._pool = ProcessPoolExecutor(
            workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_prepare,
            initargs=(problem, os.getpid()),
        )

    def collect(self, explorer: Explorer, groups: Sequence[Group]) -> list[Trajectories]:
        """Play `groups`; their generators advance as if the groups had been played in this process."""
        results = list(self._pool.map(_play, [explorer] * len(groups), groups))
        # A worker advances its copy of the generator; without this the next batch would repeat the same random numbers.
        for group, (_, rng) in zip(groups, results, strict=True):
            group.rng.bit_generator.state = rng.bit_generator.state
        return [batch for batch, _ in results]


def _prepare(problem: Problem, parent: int) -> None:
    global _collector  # one per worker process
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent handles it
    end_with(parent)
    torch.set_num_threads(1)
    _collector = Collector(problem)


def _play(explorer: Explorer, group: Group) -> tuple[Trajectories, np.random.Generator]:
    assert _collector is not None, "a worker is prepared before it plays"
    return group.collect(_collector, explorer), group.rng
