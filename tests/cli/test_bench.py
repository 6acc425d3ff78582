"""`codesign-bench bench`: bad input is answered in a line."""

from __future__ import annotations

import pytest

from codesign_bench.cli import main


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--only", "gnn_poo"], "unknown learner 'gnn_poo'; choose from: gnn_ppo"),
        (["--epochs", "0"], "--epochs: expected an integer from 1"),
        (["--cores", "4096"], "--cores 4096: there are only"),
        (["--cells", "4096"], "--cores 1 for each of --cells 4096: there are only"),
        (["--cells", "0"], "--cells: expected an integer from 1"),
        (["--task", "pull"], "unknown task 'pull'"),
    ],
)
def test_bad_input_about_learners_gets_one_line(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["bench", "learner", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_bad_input_about_tasks_gets_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "tasks", "--task", "pull"]) == 2
    assert "unknown task 'pull'" in capsys.readouterr().err
    assert main(["bench", "tasks", "--task", "push", "--seconds", "-1"]) == 2
    assert "--seconds: expected a number above 0 to 86400" in capsys.readouterr().err
