"""`codesign-bench reference`: points are measured, kept and shown."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cli import main
from codesign_bench.storage.reference_points import load_reference_points

pytestmark = pytest.mark.usefixtures("toy")


def test_points_are_measured_once_and_shown_every_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["reference", "--task", "toy_reach", "--results", str(tmp_path / "runs"), "--jobs", "1"]
    assert main(arguments) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("playing the reference points of toy_reach")
    assert [line.split(" | ")[1] for line in told[3:]] == ["idle", "random_tool", "best_known"]
    assert load_reference_points(tmp_path / "runs")["task"].unique().tolist() == ["toy_reach"]
    assert main(arguments) == 0
    assert capsys.readouterr().out.splitlines() == told[1:]
    assert main([*arguments, "--again"]) == 0
    again = capsys.readouterr().out.splitlines()
    assert (again[0].split(":")[0], again[1:]) == (told[0].split(":")[0], told[1:])


def test_a_dry_run_says_how_much_would_be_played_and_plays_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["reference", "--task", "toy_reach", "--results", str(tmp_path / "runs"), "--jobs", "1", "--dry-run"]
    assert main(arguments) == 0
    assert capsys.readouterr().out.startswith("toy_reach: at most 16 episodes, 96 environment steps, ")
    assert not (tmp_path / "runs").exists()
    assert main(arguments[:-1]) == 0
    capsys.readouterr()
    assert main(arguments) == 0
    assert capsys.readouterr().out.splitlines() == ["toy_reach: nothing to play", "nothing was played"]


@pytest.mark.parametrize(("arguments", "named"), [(("--task", "pull"), "toy_reach"), (("--jobs", "0"), "--jobs")])
def test_bad_input_is_named(
    arguments: tuple[str, ...], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["reference", *arguments, "--results", str(tmp_path)]) == 2
    assert named in capsys.readouterr().err
