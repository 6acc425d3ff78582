"""`codesign-bench verify`: a row per claim, printed and written, and bad input answered in a line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from codesign_bench.claims.evidence import load_evidence
from codesign_bench.claims.finding import NOT_ASKED, VERDICTS
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.study.study import load_study
from evidence import make_results

PAPER = load_study("corl2023")
CLAIMS = PAPER.claims()


def test_verify_prints_and_writes_a_row_for_each_claim(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results, out = tmp_path / "runs", tmp_path / "claims"
    make_results(results)
    assert main(["verify", "--results", str(results), "--out", str(out)]) == 0
    printed = capsys.readouterr().out.splitlines()
    rows = {line.split()[1]: line for line in printed if line.split()[0] in VERDICTS}
    assert set(rows) == {claim.name for claim in CLAIMS if set(claim.tasks) <= {"push"}}
    # Returns of 2, 2.1 and 2.2 against 1: 1.1 -+ 4.303 * 0.1 / sqrt 3, t = 1.1 sqrt 3 / 0.1 and p = 0.0027.
    expected = "supported final_return.push.cma_rl 1.10 [0.85, 1.35] 0.003 0.005"
    assert " ".join(rows["final_return.push.cma_rl"].split()[:7]) == expected, "a family of one, judged up to two times"
    assert rows["steps.push.cma_rl"].split()[0] == "supported"
    assert rows["tools_vary.push"].startswith("undecided")
    assert rows["final_return.push.cma_es"].startswith("undecided")
    assert printed[-3].startswith("commits: not recorded (all ")
    assert printed[-2:] == [str(out / "claims.json"), str(out / "claims.md")]

    content = json.loads((out / "claims.json").read_text())
    written = {row["name"]: row for row in (*content["claims"], *content["checks_of_scenes"])}
    assert set(written) == {claim.name for claim in CLAIMS}
    assert {name for name, row in written.items() if row["verdict"] != NOT_ASKED} == set(rows)
    assert written["final_return.push.cma_rl"]["value"] == pytest.approx(1.1)
    assert written["final_return.push.cma_rl"]["verdict"] == "supported"
    assert written["final_return.push.cma_es"]["value"] is None
    page = (out / "claims.md").read_text()
    assert content["made"] == printed[-4:-2]
    assert f"## How the cells were made\n\n{printed[-4]}\n\n- {printed[-3]}\n" in page
    assert {claim.name for claim in CLAIMS if claim.sentence in page} == set(rows)


def test_two_results_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make_results(tmp_path / "runs")
    given = ["verify", "--results", str(tmp_path / "runs"), "--out", str(tmp_path / "claims"), "--compare"]
    assert main([*given, str(tmp_path / "runs")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(tmp_path / "claims" / "agreement.md")
    assert main([*given, str(tmp_path / "nowhere")]) == 2
    assert f"no results folder '{tmp_path / 'nowhere'}'" in capsys.readouterr().err


def test_other_bad_input_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    for results in (tmp_path / "nowhere", tmp_path):
        assert main(["verify", "--results", str(results), "--out", str(tmp_path / "claims")]) == 2
        assert str(results) in capsys.readouterr().err
    make_results(tmp_path / "runs")
    assert main(["verify", "--results", str(tmp_path / "runs"), "--out", str(tmp_path / "file" / "claims")]) == 2
    assert "not writable" in capsys.readouterr().err
    with pytest.raises(UserError, match="nowhere"):
        load_evidence(tmp_path / "nowhere")


@pytest.mark.parametrize("command", ["status", "verify", "report", "plot"])
def test_a_folder_whose_name_is_no_text_can_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    results = tmp_path / os.fsdecode(b"runs-\xff")
    make_results(results)
    out = {"verify": "claims", "report": "report.html", "plot": "figures"}.get(command)
    arguments = [command, "--results", str(results), *(["--out", str(tmp_path / out)] if out else [])]
    assert main(arguments) == 0
    assert capsys.readouterr().err == ""
