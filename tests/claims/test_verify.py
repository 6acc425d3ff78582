"""What claims lack is measured on demand, and both files are written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from codesign_bench.claims.agreement import SAME
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.finding import SUPPORTED, Finding
from codesign_bench.claims.verify import AGREEMENT_JSON, AGREEMENT_MARKDOWN, JSON_FILE, MARKDOWN_FILE, verify
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from evidence import claim, make_results, study_of


def test_data_are_measured_where_asked_and_what_cannot_be_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measured = []

    def measure(results: Path, log: Log) -> None:
        measured.append(results)

    def refuse(results: Path, log: Log) -> None:
        raise UserError("no policy")

    def needing(name: str, how: object, task: str = "push") -> Claim:
        plain = claim(name, Finding(SUPPORTED, 1.0))
        return replace(plain, tasks=(task,), rule=replace(plain.rule, measure=how))

    make_results(tmp_path / "runs")
    study = study_of([needing("one", measure), needing("two", refuse), needing("elsewhere", measure, "weave")])
    verify(study, tmp_path / "runs", tmp_path / "out", Console())
    assert measured == []
    verify(study, tmp_path / "runs", tmp_path / "out", Console(), measure=True, left_out=["a file"])
    assert measured == [tmp_path / "runs"], "once for each claim about a task that there are results of"
    assert "two left out: no policy" in capsys.readouterr().out
    content = json.loads((tmp_path / "out" / JSON_FILE).read_text())
    assert {entry["name"]: entry["verdict"] for entry in content["claims"]}["one"] == SUPPORTED
    assert content["left_out"] == ["a file"]
    assert "- a file" in (tmp_path / "out" / MARKDOWN_FILE).read_text()


def test_verdicts_on_two_results_are_written_side_by_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("here", "there"):
        make_results(tmp_path / name)
    study = study_of([claim("one", Finding(SUPPORTED, 1.0)), claim("lacking", None)])
    verify(study, tmp_path / "here", tmp_path / "out", Console(), compared=tmp_path / "there")
    printed = capsys.readouterr().out
    assert "1 claims with data in both: 0 opposite, 0 decided here, 0 decided there, 0 other verdict, 1 same" in printed
    content = json.loads((tmp_path / "out" / AGREEMENT_JSON).read_text())
    assert [(entry["name"], entry["agreement"]) for entry in content["claims"]] == [("one", SAME)]
    assert "| one | same | supported | supported |" in (tmp_path / "out" / AGREEMENT_MARKDOWN).read_text()
