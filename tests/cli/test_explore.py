"""`codesign-bench explore` writes a page and tells where; bad input is answered in a line."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import VERSION_0_1_0
from codesign_bench.cli import main
from explorer_pages import data_of


def test_a_page_has_the_chosen_cells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "explorer.html"
    chosen = ("--task", "push", "--method", "cma_es", "--seeds", "1,0", "--goals", "4")
    assert main(["explore", "--results", str(VERSION_0_1_0), *chosen, "--out", str(out)]) == 0
    (task,) = data_of(out.read_text(encoding="utf-8"))["tasks"]
    assert [(cell["method"], cell["seed"]) for cell in task["cells"]] == [("cma_es", 0), ("cma_es", 1)]
    assert str(out.name) in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--results", "nowhere"), "nowhere"),
        (("--task", "no_task"), "no_task"),
        (("--method", "no_method"), "no_method"),
        (("--seeds", "x"), "--seeds"),
        (("--goals", "1"), "--goals"),
        (("--out", "page.pdf"), ".html"),
    ],
)
def test_bad_input_is_named_in_a_line(
    arguments: tuple[str, ...],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["explore", "--results", str(VERSION_0_1_0), *arguments]) == 2
    message = capsys.readouterr().err.strip()
    assert named in message
    assert not (tmp_path / "results").exists()
