"""The loop that plays episodes step by step; evaluation, pictures, export and deployment all use it.

Shapes: `B` slots, `b` the slots that take a step, `O` observation, `C` control, `I` instance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from codesign_bench.task.behaviour import Behaviour
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.spaces import Booleans, Floats, Singles, Slots

Observe: TypeAlias = Callable[[Episodes, Slots], Singles]
"""Returns the observations (b, O) that a behaviour gets in slots (b,)."""


@dataclass(frozen=True)
class Turn:
    """One step of every running episode: the design step first, then control steps."""

    step: int
    """Control steps taken so far; 0 at the design step."""
    slots: Slots
    """(b,) slots that took the step."""
    controls: Floats
    """(b, C) in [-1, 1]; zero at the design step."""
    reward: Floats
    """(b,) zero at the design step."""
    over: Booleans
    """(b,) whether the episode ended with this step."""


def play(episodes: Episodes, behaviour: Behaviour, instances: Floats, observe: Observe | None = None) -> Iterator[Turn]:
    """Play one episode of each of `instances` (B, I) in the first slots of `episodes`; yield after every step.

    The caller may read `episodes` between steps and may stop iterating before the end.

    Args:
        episodes: has at least B slots.
        behaviour: designs and acts; its designs and controls are clipped to [-1, 1].
        instances: in the instance space's units.
        observe: gives `behaviour` its observations in the control phase; None: the unchanged ones.

    Raises:
        ValueError: the behaviour's designs or controls have another shape or are not finite.
    """
    count, see = len(instances), observe or _as_it_is
    slots = np.arange(count)
    episodes.begin(slots, instances)
    episodes.design(slots, np.asarray(behaviour.design(episodes.observation[slots]), dtype=np.float64))
    nothing = np.zeros((count, episodes.task.control_space.size))
    yield Turn(0, slots, nothing, np.zeros(count), np.zeros(count, dtype=bool))
    step = 0
    while slots.size:
        step += 1
        controls = np.asarray(behaviour.act(see(episodes, slots)), dtype=np.float64)
        reward, terminated, truncated = episodes.control(slots, controls)
        over = terminated | truncated
        yield Turn(step, slots, np.clip(controls, -1.0, 1.0), reward, over)
        slots = slots[~over]


def first_observations(episodes: Episodes, instances: Floats) -> Singles:
    """Return a designer's observations (B, O) of `instances` (B, I); leaves the episodes in their design phase."""
    episodes.begin(np.arange(len(instances)), instances)
    return episodes.observation[: len(instances)].copy()


def designed(episodes: Episodes, behaviour: Behaviour, instances: Floats) -> Floats:
    """Return the designs (B, D) of `behaviour` for `instances` (B, I), in the design space's units.

    Leaves the episodes right after their design step.
    """
    next(play(episodes, behaviour, instances))
    return episodes.designs[: len(instances)].copy()


def _as_it_is(episodes: Episodes, slots: Slots) -> Singles:
    return episodes.observation[slots]
