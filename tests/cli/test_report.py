"""`codesign-bench report` writes a page and tells where; bad input is answered in a line."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.cli import main
from reports import make_cell


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--results", "nowhere"), "nowhere"),
        (("--results", "empty"), "no cells in 'empty'"),
        (("--results", "runs", "--out", "report.pdf"), ".html"),
        (("--results", "runs", "--out", "folder.html"), "folder.html"),
        (("--results", "runs", "--out", "runs/reach/gnn_ppo/default/seed-00/cell.json/report.html"), "not writable"),
    ],
)
def test_bad_input_is_named_in_a_line(
    arguments: tuple[str, ...],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    make_cell(tmp_path / "runs", 0)
    (tmp_path / "empty").mkdir()
    (tmp_path / "folder.html").mkdir()
    monkeypatch.chdir(tmp_path)
    assert main(["report", *arguments]) == 2
    told = capsys.readouterr().err.strip()
    assert named in told
    assert told.count("\n") <= 1
    assert not (tmp_path / "results").exists()


def test_the_command_writes_the_page_and_tells_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_cell(tmp_path / "runs", 0)
    out = tmp_path / "new" / "report.html"
    assert main(["report", "--results", str(tmp_path / "runs"), "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(out)]
    assert out.read_text(encoding="utf-8").rstrip().endswith("</html>")
