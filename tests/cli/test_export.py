"""`codesign-bench export`: what is written, what its options mean, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from builders import VERSION_0_1_0
from codesign_bench.cli import main

PUSH = VERSION_0_1_0 / "push" / "gnn_ppo" / "default" / "seed-00"
FETCH = VERSION_0_1_0 / "fetch_cube" / "gnn_ppo" / "default" / "seed-00"
trimesh = pytest.importorskip("trimesh")


def sheet(folder: Path) -> dict:
    """Return the one sheet in a folder."""
    (path,) = folder.glob("*.json")
    return dict(json.loads(path.read_text()))


def test_a_start_with_a_minus_sign_is_no_option(tmp_path: Path) -> None:
    assert main(["export", "--policy", str(FETCH), "--start", "-0.2,0.7", "--out", str(tmp_path)]) == 0
    values = sheet(tmp_path)
    assert values["instances"] == {"start--0.2_0.7": {"cube_start_x": -0.2, "cube_start_y": 0.7}}
    assert values["handle"] == "the gripper's, added"
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".csv", ".json", ".obj", ".png", ".stl"]
    (stl,) = tmp_path.glob("*.stl")
    mesh = trimesh.load_mesh(stl)
    assert mesh.is_volume
    assert mesh.volume == pytest.approx(values["volume_mm3"], rel=1e-4)
    assert mesh.extents == pytest.approx(values["bounding_box_mm"], rel=1e-4)
    (png,) = tmp_path.glob("*.png")
    assert np.asarray(Image.open(png).convert("L")).std() > 10.0, "something is drawn"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--start", "1,2"], "--start: no object of task 'push' has one"),
        (["--goal", "1"], "goal_x (11 to 21 m), goal_y"),
        (["--goal", "a,b"], "give a number for each"),
        (["--instances", "128"], "0 to 127, or all"),
        (["--instances", "first"], "0 to 127, or all"),
        (["--instances", "0", "--scale", "0"], "--scale: expected a number above 0"),
        (["--instances", "0", "--task", "scoop"], "trained on 'push', not on 'scoop'"),
    ],
)
def test_bad_input_gets_one_line(
    arguments: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "--policy", str(PUSH), *arguments, "--out", str(tmp_path / "out")]) == 2
    message = capsys.readouterr().err
    assert told in message
    assert len(message.strip().splitlines()) <= 2
    assert not (tmp_path / "out").exists()


def test_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    order = ["export", "--policy", str(PUSH), "--instances", "0", "--out", str(tmp_path)]
    assert main(order) == 0
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert main(order) == 2
    assert "already exists; choose another folder" in capsys.readouterr().err
    assert before == {path: path.read_bytes() for path in tmp_path.iterdir()}
