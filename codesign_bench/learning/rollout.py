"""Collect whole episodes from many slots at once.

Shapes: `S` slots, `b` slots that a call names, `T` steps, `O` observation, `D` design, `C` control.

A batch holds whole episodes only: every slot plays episodes until it has taken its share of the steps. So the design
step's return is known, a batch begins and ends without a simulator's state, and no value is needed to cut an episode.

The slots of a batch form groups, each with its own random stream and its own batched calls of the policy. Groups are
what is spread over processes: how many there are follows from the number of slots alone, so that no number depends on
how many processes play them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch

from codesign_bench.learning.actor import Actor
from codesign_bench.method import Problem
from codesign_bench.task import Booleans, Floats, Singles, Slots
from codesign_bench.task.episodes import Episodes

LOG_SQRT_TWO_PI = 0.5 * float(np.log(2.0 * np.pi))

GROUP_SLOTS = 96
"""A group has at least so many slots, unless the batch has fewer: smaller calls of the policy cost more per step."""


@dataclass(frozen=True)
class Trajectories:
    """Steps of whole episodes; rows of a slot beyond its last step are not `valid`."""

    observation: Singles
    """(S, T, O) what the policy saw."""
    control: Singles
    """(S, T, C) sampled controls, before clipping; zero at design steps."""
    design: Singles
    """(S, T, D) sampled designs, before clipping; zero at control steps."""
    log_prob: Singles
    """(S, T) log-probability of the sampled action."""
    reward: Floats
    """(S, T)"""
    is_design: Booleans
    """(S, T)"""
    terminated: Booleans
    """(S, T)"""
    truncated: Booleans
    """(S, T)"""
    success: Booleans
    """(S, T) whether the step solved the task."""
    valid: Booleans
    """(S, T)"""
    final_observation: Singles
    """(S, T, O) the state after a truncated step; zero elsewhere."""

    @property
    def env_steps(self) -> int:
        """Number of environment steps, design steps included."""
        return int(self.valid.sum())

    @property
    def episode_end(self) -> Booleans:
        """(S, T) last steps of episodes."""
        return self.terminated | self.truncated

    def summary(self) -> dict[str, float]:
        """Return mean return, length and success rate of the sampled episodes."""
        episodes = max(1, int(self.episode_end.sum()))
        return {
            "train_return": float(self.reward.sum()) / episodes,
            "train_success": int(self.success.sum()) / episodes,
            "train_episode_length": float((self.valid & ~self.is_design).sum()) / episodes,
        }


def slots_for(steps: int, batch_size: int, episode_steps: int, num_slots: int | None) -> int:
    """Return how many slots to use for a batch of min(steps, batch_size) steps: as many as give whole episodes."""
    wanted = max(1, round(min(steps, batch_size) / episode_steps))
    return wanted if num_slots is None else min(wanted, num_slots)


def group_sizes(num_slots: int, max_slots: int) -> list[int]:
    """Return the sizes of the groups that `num_slots` slots form: one, or an even number, as equal as can be.

    No group has more than `max_slots`, the task's most.
    """
    pairs = num_slots // (2 * GROUP_SLOTS)
    if num_slots > max_slots:
        pairs = max(pairs, -(-num_slots // (2 * max_slots)))
    count = 2 * pairs or 1
    return [len(part) for part in np.array_split(np.arange(num_slots), count)]


def joined(groups: Sequence[Trajectories]) -> Trajectories:
    """Return the slots of all groups, one group after the other, as one batch."""
    if len(groups) == 1:
        return groups[0]
    length = max(group.valid.shape[1] for group in groups)

    def padded(values: np.ndarray) -> np.ndarray:
        missing = [(0, 0)] * values.ndim
        missing[1] = (0, length - values.shape[1])
        return np.pad(values, missing)

    names = [field.name for field in fields(Trajectories)]
    return Trajectories(**{name: np.concatenate([padded(getattr(group, name)) for group in groups]) for name in names})


class Collector:
    """Rolls a policy out in the simulator that the problem lends."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def collect(
        self,
        actor: Actor,
        steps: int,
        num_slots: int,
        rng: np.random.Generator,
        given_designs: Singles | None = None,
    ) -> Trajectories:
        """Play whole episodes in `num_slots` slots until each has taken steps / num_slots steps.

        Args:
            actor: its distributions are sampled.
            steps: environment steps wanted; the last episode of every slot is finished.
            num_slots: slots to use.
            rng: source of instances and of all noise.
            given_designs: (S, D) designs to use instead of the actor's, one for all episodes of a slot.
        """
        task = self.problem.task
        share = max(1, steps // num_slots)
        capacity = share + task.horizon + 1
        data = _empty(num_slots, capacity, task.layout.size, task.control_space.size, task.design_space.size)
        control_noise = rng.standard_normal((num_slots, capacity, task.control_space.size), dtype=np.float32)
        time = np.zeros(num_slots, dtype=np.intp)
        starting = np.ones(num_slots, dtype=bool)
        with torch.inference_mode(), self.problem.episodes(num_slots) as episodes:
            while True:
                fresh = np.flatnonzero(starting & (time < share))
                if fresh.size:
                    self._design(episodes, actor, data, fresh, time, rng, given_designs)
                    starting[fresh] = False
                active = np.flatnonzero(~starting)
                if not active.size:
                    return data
                ended = _control(episodes, actor, data, active, time, control_noise)
                starting[active[ended]] = True

    def _design(
        self,
        episodes: Episodes,
        actor: Actor,
        data: Trajectories,
        slots: Slots,
        time: Slots,
        rng: np.random.Generator,
        given_designs: Singles | None,
    ) -> None:
        episodes.begin(slots, self.problem.sample_instances(rng, slots.size))
        observation = episodes.observation[slots]
        now = time[slots]
        if given_designs is None:
            mean, log_std = actor.design(torch.from_numpy(observation))
            noise = rng.standard_normal(mean.shape, dtype=np.float32)
            designs = mean.numpy() + np.exp(log_std.numpy()) * noise
            data.log_prob[slots, now] = gaussian_log_prob(noise, log_std.numpy())
        else:
            designs = given_designs[slots]
        data.observation[slots, now] = observation
        data.design[slots, now] = designs
        data.is_design[slots, now] = True
        data.valid[slots, now] = True
        episodes.design(slots, designs.astype(np.float64))
        time[slots] += 1


def _control(
    episodes: Episodes, actor: Actor, data: Trajectories, slots: Slots, time: Slots, control_noise: Singles
) -> Booleans:
    observation = episodes.observation[slots]
    now = time[slots]
    mean, log_std = actor.control(torch.from_numpy(observation))
    noise = control_noise[slots, now]
    controls = mean.numpy() + np.exp(log_std.numpy()) * noise
    reward, terminated, truncated = episodes.control(slots, controls.astype(np.float64))
    data.observation[slots, now] = observation
    data.control[slots, now] = controls
    data.log_prob[slots, now] = gaussian_log_prob(noise, log_std.numpy())
    data.reward[slots, now] = reward
    data.terminated[slots, now] = terminated
    data.truncated[slots, now] = truncated
    data.success[slots, now] = episodes.success(slots)
    data.valid[slots, now] = True
    cut = slots[truncated]
    data.final_observation[cut, time[cut]] = episodes.observation[cut]
    time[slots] += 1
    return terminated | truncated


def gaussian_log_prob(noise: Singles, log_std: Singles) -> Singles:
    """Return the (b,) log-probability of mean + exp(log_std) noise for standard-normal `noise` (b, A)."""
    result: Singles = -0.5 * (noise**2).sum(axis=-1) - (log_std + LOG_SQRT_TWO_PI).sum()
    return result


def _empty(slots: int, steps: int, observation: int, control: int, design: int) -> Trajectories:
    def singles(*shape: int) -> Singles:
        return np.zeros((slots, steps, *shape), dtype=np.float32)

    def booleans() -> Booleans:
        return np.zeros((slots, steps), dtype=bool)

    return Trajectories(
        observation=singles(observation),
        control=singles(control),
        design=singles(design),
        log_prob=singles(),
        reward=np.zeros((slots, steps)),
        is_design=booleans(),
        terminated=booleans(),
        truncated=booleans(),
        success=booleans(),
        valid=booleans(),
        final_observation=singles(observation),
    )
