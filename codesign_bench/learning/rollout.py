"""Collect whole episodes from many slots in parallel.

Shapes: `S` slots, `b` slots of a call, `T` steps, `C` control, `Z` noise of a control step.

A batch contains only whole episodes: every slot plays episodes until it has taken its share of the steps. So the return
of the design step is known, no simulator state is saved between batches, and no episode is cut and bootstrapped at the
end of a batch.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.method import Problem
from codesign_bench.task import Booleans, Singles, Slots
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.simulators import Simulators


class Collector:
    """Plays episodes of a problem."""

    def __init__(self, problem: Problem, simulators: Simulators | None = None) -> None:
        self.problem = problem
        self.simulators = simulators
        """Lend the simulator; None: those that the problem shares."""

    def collect(
        self,
        explorer: Explorer,
        steps: int,
        num_slots: int,
        rng: np.random.Generator,
        first_slot: int = 0,
        most: int | None = None,
    ) -> Trajectories:
        """Play whole episodes in `num_slots` slots until each has taken steps / num_slots steps.

        Args:
            explorer: chooses designs and controls.
            steps: environment steps wanted; the last episode of every slot is finished.
            num_slots: slots to use.
            rng: source of instances and of all noise.
            first_slot: the index of the first of these slots in the batch, as the explorer counts.
            most: environment steps that further episodes must not exceed, whatever their length; the first episode of
                every slot is always played. None: no limit.
        """
        share = max(1, steps // num_slots)
        with self.problem.episodes(num_slots, self.simulators) as episodes:
            return _Rollout(self.problem, episodes, explorer, share, num_slots, rng, first_slot, most).play()


class _Rollout:
    """The rollout of one group of slots."""

    def __init__(
        self,
        problem: Problem,
        episodes: Episodes,
        explorer: Explorer,
        share: int,
        num_slots: int,
        rng: np.random.Generator,
        first_slot: int,
        most: int | None,
    ) -> None:
        # A slot may begin its last episode one step before its share is reached, and finishes it.
        task, capacity = problem.task, share + problem.task.horizon + 1
        sizes = task.layout.size, task.control_space.size, task.design_space.size
        self.problem, self.episodes, self.explorer, self.rng = problem, episodes, explorer, rng
        self.share, self.first_slot, self.most = share, first_slot, most
        self.data = Trajectories.empty(num_slots, capacity, *sizes)
        # One draw for all steps: a draw per step would be slower and would depend on which slots are active.
        self.control_noise = rng.standard_normal((num_slots, capacity, explorer.control_noise), dtype=np.float32)
        self.time = np.zeros(num_slots, dtype=np.intp)
        """(S,) steps that each slot has taken."""
        self.episode = np.zeros(num_slots, dtype=np.intp)
        """(S,) episodes that each slot has begun."""
        self.latest_end = np.full(num_slots, task.horizon + 1, dtype=np.intp)
        """(S,) steps that each slot will have taken at most when the episode ends that it plays or plays next."""

    def play(self) -> Trajectories:
        """Play until every slot has taken its share of the steps."""
        starting = np.ones(len(self.time), dtype=bool)
        while True:
            fresh = self._affordable(np.flatnonzero(starting & (self.time < self.share)))
            if fresh.size:
                self._design(fresh)
                starting[fresh] = False
            active = np.flatnonzero(~starting)
            if not active.size:
                return self.data
            ended = self._control(active)
            starting[active[ended]] = True

    def _affordable(self, slots: Slots) -> Slots:
        """Return those of `slots` (b,) that may begin an episode: all, or as many as the limit leaves room for."""
        if self.most is None or not slots.size or not self.episode[slots].all():  # first episodes begin together
            return slots
        episode = self.problem.task.horizon + 1
        self.latest_end[slots] = self.time[slots]
        chosen = slots[: max(0, (self.most - int(self.latest_end.sum())) // episode)]
        self.latest_end[chosen] += episode
        return chosen

    def _design(self, slots: Slots) -> None:
        """Begin an episode in `slots` (b,) and take its design step."""
        instances = self.explorer.instances(self.first_slot + slots, self.episode[slots])
        if instances is None:
            instances = self.problem.sample_instances(self.rng, slots.size)
        self.episodes.begin(slots, instances)
        self.episode[slots] += 1
        observation = self.episodes.observation[slots]
        noise = self.rng.standard_normal((slots.size, self.explorer.design_noise), dtype=np.float32)
        sample = self.explorer.sample_design(self.first_slot + slots, observation, noise)
        self.data.design[slots, self.time[slots]] = sample.actions
        self.data.is_design[slots, self.time[slots]] = True
        self._store(slots, observation, sample)
        self.episodes.design(slots, sample.actions.astype(np.float64))
        self.time[slots] += 1

    def _control(self, slots: Slots) -> Booleans:
        """Take one control step in `slots` (b,); return which episodes ended, (b,)."""
        episodes, data, now = self.episodes, self.data, self.time[slots]
        observation = episodes.observation[slots]
        sample = self.explorer.sample_control(self.first_slot + slots, observation, self.control_noise[slots, now])
        reward, terminated, truncated = episodes.control(slots, sample.actions.astype(np.float64))
        data.control[slots, now] = sample.actions
        data.reward[slots, now] = reward
        data.terminated[slots, now] = terminated
        data.truncated[slots, now] = truncated
        data.success[slots, now] = episodes.success(slots)
        self._store(slots, observation, sample)
        self._add_reward_terms(slots)
        cut = slots[truncated]
        data.final_observation[cut, self.time[cut]] = episodes.observation[cut]
        self.time[slots] += 1
        return terminated | truncated

    def _store(self, slots: Slots, observation: Singles, sample: Sample) -> None:
        data, now = self.data, self.time[slots]
        data.observation[slots, now] = observation
        data.valid[slots, now] = True
        for name, values in sample.extras.items():
            if name not in data.extras:
                data.extras[name] = np.zeros((*data.valid.shape, *values.shape[1:]), dtype=values.dtype)
            data.extras[name][slots, now] = values

    def _add_reward_terms(self, slots: Slots) -> None:
        totals = self.data.reward_terms
        for name, values in self.episodes.reward_terms.items():
            totals[name] = totals.get(name, 0.0) + float(values[slots].sum())
