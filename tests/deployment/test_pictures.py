"""A film of a trial shows its start, every third step and its end, in simulated time."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
import pytest
from PIL import Image

from codesign_bench.deployment.pictures import STRIDE, Film
from codesign_bench.evaluation.rendering import CAPTION_PIXELS
from codesign_bench.task import load_task
from codesign_bench.task.episodes import Episodes

SLOT = np.array([0])
PERIOD = 0.1
"""s, of a control step."""


def started() -> Episodes:
    """Return an episode of push right after its design step."""
    task = load_task("push")
    episodes = Episodes(task, 1)
    episodes.begin(SLOT, task.evaluation_instances()[:1])
    episodes.design(SLOT, np.zeros((1, task.design_space.size)))
    return episodes


def durations(film: Film) -> list[float]:
    """Return how long each picture of a film stands, in s."""
    with Image.open(io.BytesIO(film.gif(PERIOD))) as pictures:
        found = []
        for number in range(pictures.n_frames):  # type: ignore[attr-defined]
            pictures.seek(number)
            found.append(pictures.info["duration"] / 1000.0)
        return found


def filmed(max_steps: int, steps: int, ends: Sequence[str] = ()) -> Film:
    """Return the film of an idle trial; after the last of its steps the arrays `ends` of the simulator are set."""
    film, episodes = Film("Push, tool 1", max_steps), started()
    film(episodes)
    for step in range(1, steps + 1):
        episodes.control(SLOT, np.zeros((1, episodes.task.control_space.size)))
        for name in ends if step == steps else ():
            getattr(episodes.simulator, name)[0] = True
        film(episodes)
    return film


def test_every_third_step_is_shown_and_the_last_one() -> None:
    assert STRIDE == 3
    assert len(durations(filmed(max_steps=7, steps=7))) == 4  # 0, 3, 6 and 7
    assert len(durations(filmed(max_steps=6, steps=6))) == 3  # 0, 3 and 6, which is the last


@pytest.mark.parametrize("end", ["success", "failure"])
def test_a_trial_that_ends_early_is_shown_to_its_end(end: str) -> None:
    assert len(durations(filmed(max_steps=100, steps=4))) == 2
    assert len(durations(filmed(max_steps=100, steps=4, ends=[end]))) == 3


def test_pictures_stand_as_long_as_their_steps_take() -> None:
    assert durations(filmed(max_steps=7, steps=7))[:-1] == pytest.approx([STRIDE * PERIOD] * 3, abs=0.01)


def test_a_picture_is_the_scene_under_its_caption() -> None:
    height, width = started().simulator.render(0).shape[:2]
    with Image.open(io.BytesIO(filmed(max_steps=1, steps=1).gif(PERIOD))) as picture:
        assert picture.size == (width, height + CAPTION_PIXELS)
