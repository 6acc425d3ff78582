"""Recorded episodes: what follows an end is zero, and the first difference is named."""

from __future__ import annotations

import numpy as np

from codesign_bench.contract.recording import EPISODES, Script, difference, random_script, record
from codesign_bench.task.episodes import Episodes
from sound import SoundReach

TASK = SoundReach()


def test_random_controls_are_held_for_a_while() -> None:
    script = random_script(TASK, steps=25)
    assert script.instances.shape == script.designs.shape == (EPISODES, 1)
    assert script.controls.shape == (25, EPISODES, 1)
    assert (script.controls[0] == script.controls[9]).all()
    assert (script.controls[9] != script.controls[10]).any()


def test_a_recording_by_hand() -> None:
    script = Script(np.array([[0.5], [1.0]]), np.array([[-1.0], [1.0]]), np.ones((3, 2, 1)))
    played = record(Episodes(TASK, 2), script, np.array([1, 0]))
    tips = played.observation[:, 0, 0]
    np.testing.assert_allclose(tips, [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-6)
    np.testing.assert_allclose(played.reward[:, 0], 0.1)
    assert not played.terminated[:, 0].any()
    np.testing.assert_allclose(played.observation[:, 1, 0], [0.0, 1.0, 1.1, 1.2, 1.3], atol=1e-6)
    assert played.one(1).reward.shape == (3, 1)


def test_the_first_difference_is_named() -> None:
    script = random_script(TASK)
    first, second = (record(Episodes(TASK, EPISODES), script, np.arange(EPISODES)) for _ in range(2))
    assert difference(TASK, first, second) == ""
    second.reward[1, 2] += 1.0
    assert difference(TASK, first, second).startswith("the reward after control step 2: ")
    second.observation[1, 0, 0] += 1.0
    assert difference(TASK, first, second).startswith("the observation of tip after the design step: ")
