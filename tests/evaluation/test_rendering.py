"""Animations and pictures of scripts, random behaviour and trained policies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from builders import VERSION_0_1_0
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.evaluation.rendering import CAPTION_PIXELS, FRAMES_PER_SECOND, MOMENTS, render
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import RandomBehaviour

TRAINED = VERSION_0_1_0 / "push" / "gnn_ppo" / "default" / "seed-00"


def frame_size(task_name: str) -> tuple[int, int]:
    """Return width and height of one frame of a task."""
    height, width = load_task(task_name).make_simulator(1).render(0).shape[:2]
    return width, height


def test_an_animation_plays_in_simulated_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "new folder" / "push.gif"
    assert main(["render", "--task", "push", "--episodes", "2", "--out", str(path)]) == 0
    assert "of 2 episodes solved" in capsys.readouterr().out
    width, height = frame_size("push")
    with Image.open(path) as picture:
        assert picture.size == (2 * width, height + CAPTION_PIXELS)
        durations = []
        for frame in range(picture.n_frames):
            picture.seek(frame)
            durations.append(picture.info["duration"])
    assert len(durations) > 5
    assert all(duration >= 1000.0 / FRAMES_PER_SECOND - 10.0 for duration in durations)
    task = load_task("push")
    assert sum(durations[:-1]) <= 1.1 * 1000.0 * task.horizon * task.control_period


def test_a_picture_has_a_row_per_episode_and_a_column_per_moment(tmp_path: Path) -> None:
    path = tmp_path / "push.png"
    assert main(["render", "--task", "push", "--episodes", "3", "--out", str(path)]) == 0
    width, height = frame_size("push")
    with Image.open(path) as picture:
        assert picture.size == (MOMENTS * width, 3 * (height + CAPTION_PIXELS))
        first, last = (
            picture.crop((0, 0, width, height)),
            picture.crop((picture.width - width, 0, picture.width, height)),
        )
        assert np.asarray(first).tobytes() != np.asarray(last).tobytes()


def test_random_behaviour_follows_its_seed(tmp_path: Path) -> None:
    first, again, other = (tmp_path / name for name in ("first.png", "again.png", "other.png"))
    for path, seed in ((first, "1"), (again, "1"), (other, "2")):
        arguments = ["--behaviour", "random", "--seed", seed, "--episodes", "1", "--out", str(path)]
        assert main(["render", "--task", "push", *arguments]) == 0
    assert first.read_bytes() == again.read_bytes() != other.read_bytes()


def test_a_trained_policy_knows_its_task(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "trained.png"
    assert main(["render", "--policy", str(TRAINED), "--out", str(path)]) == 0
    assert path.exists()
    assert main(["render", "--policy", str(TRAINED), "--task", "scoop", "--out", str(path)]) == 2
    assert "trained on 'push', not on 'scoop'" in capsys.readouterr().err


@pytest.mark.usefixtures("toy")
def test_a_task_without_pictures_or_script_says_so(tmp_path: Path) -> None:
    task = load_task("toy_reach")
    with pytest.raises(UserError, match="'toy_reach' has no script"):
        task.script()
    with pytest.raises(UserError, match="'toy_reach' draws no pictures"):
        render(task, RandomBehaviour(task, np.random.default_rng(0)), tmp_path / "toy.png")
