"""Random streams follow from a seed and their own names alone, in every process, and go on where they stood."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np

from codesign_bench.seeding import Streams, generator


def draws(rng: np.random.Generator, count: int = 4) -> list[int]:
    """Return a generator's next numbers."""
    return rng.integers(2**62, size=count).tolist()


def test_a_stream_is_the_same_generator_every_time_it_is_named() -> None:
    streams = Streams(0)
    assert streams["rollout"] is streams["rollout"]
    assert draws(streams["rollout"], 2) + draws(streams["rollout"], 2) == draws(generator(0, "rollout"), 4)


def test_seeds_and_names_make_different_streams() -> None:
    first = [tuple(draws(generator(seed, name))) for seed in (0, 1) for name in ("rollout", "instances")]
    assert len(set(first)) == 4


def test_a_stream_does_not_depend_on_which_others_are_used() -> None:
    alone, in_company = Streams(7), Streams(7)
    draws(in_company["another"])
    expected = draws(alone["search"], 4)
    assert draws(in_company["search"], 2) == expected[:2]
    draws(in_company["another"])
    assert draws(in_company["search"], 2) == expected[2:]


def test_streams_go_on_where_their_state_was_taken() -> None:
    streams = Streams(3)
    draws(streams["search"])
    state = json.loads(json.dumps(streams.state()))
    expected = draws(streams["search"])
    restored = Streams(3)
    restored.load_state(state)
    assert draws(restored["search"]) == expected
    assert set(state) == {"search"}


def test_another_process_draws_the_same_however_it_salts_its_hashes() -> None:
    line = "from codesign_bench.seeding import generator; print(generator(5, 'rollout').integers(2**62))"
    environments = [{**os.environ, "PYTHONHASHSEED": salt} for salt in ("1", "2")]
    told = [
        subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True, env=environment).stdout
        for environment in environments
    ]
    assert [int(text) for text in told] == draws(generator(5, "rollout"), 1) * 2
