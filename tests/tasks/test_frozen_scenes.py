"""Scenes are frozen under their versions: what tasks do in their first steps is pinned, up to rounding."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.registry import presented
from codesign_bench.task import load_task
from frozen_scenes import course, pinned

pytestmark = pytest.mark.numeric

PART = 1e-3
"""Of an entry's range, and of a reward of 1: processors and numpy's versions differ by 1e-6 at most in so few steps."""


@pytest.mark.parametrize("name", presented("tasks"))
def test_a_task_does_what_is_pinned_for_its_version(name: str) -> None:
    task = load_task(name)
    courses = pinned().get(name, {})
    version = str(task.version)
    assert version in courses, f"pin version {version} of {name}: python tests/frozen_scenes.py"
    found, expected = course(task), courses[version]
    changed = f"{name} does something else than version {version} did: raise its version, then pin it"
    seen, then = np.array(found["observations"]), np.array(expected["observations"])
    assert seen.shape == then.shape, changed
    width = np.maximum(1.0, np.ptp(then, axis=(0, 1)))
    assert (np.abs(seen - then) <= PART * width).all(), changed
    np.testing.assert_allclose(found["rewards"], expected["rewards"], rtol=PART, atol=PART, err_msg=changed)


def test_what_is_pinned_tells_scenes_apart() -> None:
    firsts = [np.array(versions[max(versions)]["rewards"]) for versions in pinned().values()]
    assert all(rewards.any() for rewards in firsts)
