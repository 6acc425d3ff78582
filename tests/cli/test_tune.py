"""`codesign-bench tune`: its plan, and bad input."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cli import main

pytestmark = pytest.mark.usefixtures("toy")

TUNE = ("tune", "--import", "toy_tuning", "--study", "toy_tuning")


def test_the_plan_is_printed_and_nothing_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*TUNE, "--steps", "300", "--plan"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["toy_reach", "0", "3", "100", "300"] in lines
    assert ["toy_reach", "1", "1", "300", "300"] in lines
    assert "the same for toy_aim, toy_search: 600 steps each, 1,200 in all" in " ".join(lines[-1])
    assert list(tmp_path.iterdir()) == []


def test_the_default_study_plans_the_same_for_all_of_its_methods(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", "--profile", "quick", "--plan"]) == 0
    assert "the same for gnn_ppo, shared_arch, cma_rl, hwasp_minimal, cma_es" in capsys.readouterr().out


def test_a_part_of_the_search_has_the_steps_of_the_whole_on_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", "--plan", "--task", "push", "--method", "cma_es", "cma_rl"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "push 2 2 1,000,000 4,000,000" in printed
    assert "catch_balls" not in printed
    assert "the same for cma_rl, cma_es: 11,999,992 steps each" in printed
    assert main(["tune", "--plan", "--study", "all_methods", "--task", "beyond", "--method", "cma_es", "pt_me"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "bounce 0 4" in printed
    assert "push" not in printed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--study", "neurips"], "unknown study 'neurips'"),
        (["--steps", "0"], "--steps: expected an integer from 1 to 1,000,000,000,000, not '0'"),
        (["--profile", "slow", "--plan"], "unknown profile 'slow'"),
        (["--task", "scoop", "scooop"], "unknown task 'scooop'; choose from: "),
        (
            ["--task", "scoop", "--study", "corl2023", "--method", "pt_me"],
            "--method pt_me: not part of the search; choose",
        ),
        (["--method", ","], "--method: no name given"),
        (["--jobs", "0"], "--jobs: expected an integer from 1 to 4,096, not '0'"),
    ],
)
def test_bad_input_gets_one_line(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert main(["tune", *arguments]) == 2
    assert message in capsys.readouterr().err
