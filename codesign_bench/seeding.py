"""Named, independent random streams from one seed; nothing else in the project makes randomness."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np


class Streams:
    """The random streams of one run: `streams["rollout"]` is always the same generator object.

    A stream depends on the seed and on its name alone, so a new stream never shifts the others.
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
        """Put every stream back where `state` says."""
        for name, value in state.items():
            self[name].bit_generator.state = value


def generator(seed: int, name: str) -> np.random.Generator:
    """Return a fresh generator for the stream `name` of `seed`."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),)))
