"""Conditions of a trial: what means nothing is refused, and every trial draws its own physics."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from codesign_bench.deployment.conditions import TRIAL, Conditions, Physics
from codesign_bench.errors import UserError
from codesign_bench.seeding import generator


def test_every_trial_draws_its_own_physics_and_the_same_seed_draws_it_again() -> None:
    first, again, other = (Physics.draw(TRIAL, generator(seed, "trial")) for seed in (0, 0, 1))
    assert first == again != other
    many = [Physics.draw(TRIAL, generator(seed, "trial")).friction for seed in range(200)]
    assert 0.8 <= min(many) < 0.82
    assert 1.18 < max(many) <= 1.2


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"arm": "crane"}, "unknown arm 'crane'; choose from: panda, ideal"),
        ({"observation_noise": -1.0}, "--observation-noise"),
        ({"latency": -1}, "--latency"),
        ({"friction": 1.0}, "--friction"),
        ({"mass": float("nan")}, "--mass"),
    ],
)
def test_conditions_that_mean_nothing_are_refused(change: dict[str, Any], told: str) -> None:
    with pytest.raises(UserError, match=told):
        replace(Conditions(), **change).check()
