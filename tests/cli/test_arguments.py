"""Arguments that several commands share: what they mean and what they refuse."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cli import main


@pytest.mark.parametrize("command", [["render", "--out", "push.png"], ["deploy", "--policy", "x"]])
def test_a_seed_below_zero_is_refused(capsys: pytest.CaptureFixture[str], command: list[str]) -> None:
    assert main([*command, "--seed", "-1"]) == 2
    assert "argument --seed: expected an integer from 0 to 4,294,967,295, not '-1'" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command",
    [
        ["run", "--method", "cma_es", "--task", "push", "--out"],
        ["reproduce", "--figures"],
        ["reference", "--task", "push", "--results"],
        ["verify", "--measure", "--out"],
        ["bench", "learner", "--out"],
    ],
)
def test_what_cannot_be_written_is_refused_before_hours_of_work(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("kept")
    assert main([*command, str(tmp_path / "file" / "below")]) == 2
    assert f"argument {command[-1]}: {tmp_path / 'file' / 'below'}: not writable" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_folder_is_no_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "learner", "--out", str(tmp_path)]) == 2
    assert f"argument --out: {tmp_path}: is a folder; give a file in it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (["sigma0=0.1", "sigma0=0.2"], "'sigma0' is given twice"),
        (["cma_es.sigma0=0.1", "cma_es.sigma0=0.1"], "'cma_es.sigma0' is given twice"),
        (["steps=10"], "--steps gives it, too"),
    ],
)
def test_a_setting_is_given_once(overrides: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("run", "show"):
        assert main([command, "--method", "cma_es", "--task", "push", "--steps", "9", "--set", *overrides]) == 2
        assert told in capsys.readouterr().err
