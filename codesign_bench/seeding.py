"""Named, independent random streams from one seed: the only source of randomness in the project."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

TUNING_SEEDS = range(10)
"""Seeds on which settings may be chosen."""


class Streams:
    """The random streams of one run: `streams["rollout"]` is always the same generator object.

    A stream depends only on the seed and its own name, so adding a stream does not change the others.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._generators: dict[str, np.random.Generator] = {}

    def __getitem__(self, name: str) -> np.random.Generator:
        if name not in self._generators:
            self._generators[name] = generator(self.seed, name)
        return self._generators[name]

    def state(self) -> dict[str, Any]:
        """Return the state of every stream used so far, as JSON values."""
        return {name: rng.bit_generator.state for name, rng in self._generators.items()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Restore every stream from `state`."""
        for name, value in state.items():
            self[name].bit_generator.state = value


def generator(seed: int, name: str) -> np.random.Generator:
    """Return a new generator for the stream `name` of `seed`."""
    # Not `hash`, which Python salts differently in every process.
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),)))
