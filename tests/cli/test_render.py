"""`codesign-bench render`: bad input is answered in a line."""

from __future__ import annotations

import pytest

from codesign_bench.cli import main


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task", "push", "--out", "push.jpg"], "the file must end in .gif or .png"),
        (["--task", "pusch", "--out", "push.png"], "unknown task 'pusch'; choose from: push"),
        (["--out", "push.png"], "give --policy or --task"),
        (["--policy", "x", "--behaviour", "random", "--out", "push.png"], "either --policy or --behaviour"),
        (["--task", "push", "--episodes", "0", "--out", "push.png"], "--episodes: expected an integer from 1"),
        (["--policy", "nowhere", "--out", "push.png"], "is not a cell folder"),
        (["--task", "push", "--out", "/proc/push.png"], "not writable"),
    ],
)
def test_bad_input_gets_one_line(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert main(["render", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") <= 2
