"""`codesign-bench run`: what it refuses, and what its options mean."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from codesign_bench.cli import main
from codesign_bench.cli.program import build_parser
from codesign_bench.cli.run import overrides
from codesign_bench.storage.records import CellRecord

pytestmark = pytest.mark.usefixtures("toy")

RUN = ("run", "--method", "toy_search", "--task", "toy_reach", "--steps", "100", "--set", "evaluations=2")


def test_a_foreign_or_unwritable_folder_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.tex").write_text("")
    assert main([*RUN, "--out", str(tmp_path)]) == 2
    assert main([*RUN, "--out", str(tmp_path / "thesis.tex")]) == 2
    assert main([*RUN, "--out", "/proc/runs"]) == 2
    printed = capsys.readouterr().err.strip().splitlines()
    assert len(printed) <= 6
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_truncated_checkpoint_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*RUN, "fail_at=50", "--out", str(tmp_path)]) == 1
    checkpoint = next(tmp_path.glob("*/*/*/*/checkpoint.safetensors"))
    checkpoint.write_bytes(checkpoint.read_bytes()[:40])
    capsys.readouterr()
    assert main([*RUN, "fail_at=50", "--retry-failed", "--out", str(tmp_path)]) == 1
    assert f"checkpoint {checkpoint} is unusable" in " ".join(capsys.readouterr().out.split())


def test_another_configuration_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*RUN, "--out", str(tmp_path)]) == 0
    assert main([*RUN, "episodes=9", "--out", str(tmp_path)]) == 2
    assert "episodes: stored 4, requested 9" in capsys.readouterr().err


def test_a_dry_run_lists_every_cell_and_leaves_everything_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    out = tmp_path / "runs"
    grid = [*RUN, "--seeds", "2", "--out", str(out)]
    assert main([*grid, "--dry-run"]) == 0
    assert not out.exists()
    first = capsys.readouterr().out
    assert "timing toy_reach/toy_search ..." in first
    assert [line.split()[1] for line in first.splitlines() if "/seed-" in line] == ["run", "run"]
    assert main([*RUN, "--out", str(out)]) == 0
    assert "expected to take " in capsys.readouterr().out  # known from the dry run
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert main([*grid, "--dry-run"]) == 0
    second = capsys.readouterr().out
    assert [line.split()[1] for line in second.splitlines() if "/seed-" in line] == ["done", "run"]
    assert "timing" not in second
    assert "2 cells, 1 to run: 1 at a time with 1 thread each" in second
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def events(text: str) -> list[dict[str, Any]]:
    """Return the events that a command with --json printed; every line must be one."""
    return [json.loads(line) for line in text.splitlines()]


def test_a_program_can_follow_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    line = [*RUN, "--seeds", "2", "--out", str(tmp_path / "runs"), "--json"]
    assert main([*line, "--dry-run"]) == 0
    printed = events(capsys.readouterr().out)
    planned = [(event["cell"], event["state"]) for event in printed if event["event"] == "planned"]
    assert planned == [(f"toy_reach/toy_search/default/seed-0{seed}", "run") for seed in range(2)]
    (plan,) = [event for event in printed if event["event"] == "plan"]
    assert (plan["cells"], plan["to_run"], plan["steps"]) == (2, 2, 200)
    assert plan["expected_seconds"] > 0.0
    assert main(line) == 0
    printed = events(capsys.readouterr().out)
    assert [event["to_run"] for event in printed if event["event"] == "begin"] == [2]
    ended = [event for event in printed if event["event"] == "cell"]
    assert [(event["status"], event["env_steps"] >= 100) for event in ended] == [("done", True)] * 2
    assert printed[-1] | {"time": ""} == {
        "event": "end",
        "time": "",
        "exit_code": 0,
        "cells": 2,
        "failed": [],
        "interrupted": [],
    }


def test_a_dry_run_says_what_cannot_be_timed_and_lists_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert main([*RUN, "fail_at=50", "--dry-run", "--out", str(tmp_path / "runs")]) == 0
    output = capsys.readouterr().out
    assert "toy_reach/toy_search cannot be timed: RuntimeError: the toy broke" in output
    assert "expected time unknown" in output


def test_a_dry_run_refuses_what_a_run_would(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.tex").write_text("")
    assert main([*RUN, "--dry-run", "--out", str(tmp_path)]) == 2
    assert main([*RUN, "--dry-run", "--out", str(tmp_path / "thesis.tex")]) == 2
    refusals = capsys.readouterr().err.strip().splitlines()
    assert "contains files other than results" in refusals[0]
    assert "(Not a directory)" in refusals[1]


def test_settings_of_a_search_are_those_of_the_cells_task_and_method(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tuned, out = tmp_path / "tuned.json", tmp_path / "runs"
    winner = {"task": "toy_reach", "method": "toy_search", "set": ["toy_search.episodes=5", "toy_search.step_size=0.2"]}
    tuned.write_text(json.dumps({"winners": [winner]}))
    assert main([*RUN, "step_size=0.1", "--tuned", str(tuned), "--jobs", "1", "--out", str(out)]) == 0
    record = CellRecord.read(out / "toy_reach/toy_search/default/seed-00")
    assert record is not None
    assert (record.config.method["episodes"].value, record.config.method["step_size"].value) == (5, 0.1)
    tuned.write_text(json.dumps({"winners": [{**winner, "task": "push"}]}))
    assert main([*RUN, "--tuned", str(tuned), "--out", str(out)]) == 2
    assert "has no settings of 'toy_search' on 'toy_reach'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "has_bfloat16", "expected"),
    [
        (["--method", "gnn_ppo"], True, []),
        (["--method", "gnn_ppo", "--precision", "fp32"], True, ["precision=fp32"]),
        (["--method", "gnn_ppo", "--precision", "auto"], True, ["precision=bf16"]),
        (["--method", "gnn_ppo", "--precision", "auto"], False, ["precision=fp32"]),
        (["--method", "cma_es", "--precision", "auto"], True, []),
        (["--method", "gnn_ppo", "--device", "cpu", "--set", "epochs=2"], True, ["epochs=2", "device=cpu"]),
    ],
)
def test_device_and_precision_are_part_of_the_configuration(
    monkeypatch: pytest.MonkeyPatch, arguments: list[str], has_bfloat16: bool, expected: list[str]
) -> None:
    monkeypatch.setattr("codesign_bench.machine.computes_in_bfloat16", lambda: has_bfloat16)
    options = build_parser().parse_args(["run", "--task", "push", *arguments])
    assert overrides(options) == expected
