"""`codesign-bench verify`: a row per claim, printed and written, and bad input answered in a line."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builders import rising, store_cell
from codesign_bench.claims.claim import Claim, Rule
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.finding import (
    CONTRADICTED,
    NOT_ASKED,
    SUPPORTED,
    UNDECIDED,
    VERDICTS,
    Finding,
    InsufficientData,
)
from codesign_bench.claims.verify import as_json, as_markdown, judge, missing, summary
from codesign_bench.cli import main
from codesign_bench.cli.program import build_parser
from codesign_bench.errors import UserError
from codesign_bench.storage.frames import default_rows, load_results
from codesign_bench.storage.records import DONE, FAILED, RUNNING
from codesign_bench.study.study import Study, load_study, study_names

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "results" / "reference"
PAPER = load_study("corl2023")
CLAIMS = PAPER.claims()
ALL_CLAIMS = [claim for name in study_names() for claim in load_study(name).claims()]


def study_of(claims: Sequence[Claim]) -> Study:
    """Return a study that has these claims alone."""
    return Study(name="small", title="A small study", question="Is it so?", claims=lambda: claims)


def make_cell(out: Path, method: str, seed: int, final: float, status: str = DONE) -> Path:
    """Write a cell of push that rises from 0 to `final`, and return its folder."""
    row = {"return": final, "success": 0, "episode_length": 5, "material": 0.5, "effort": 0.5}
    lengths = {f"design_link_{link}_length": 1.0 for link in (1, 2, 3)}
    angles = {f"design_joint_{joint}_angle": 0.0 for joint in (1, 2)}
    evaluation = [{**row, **lengths, **angles}] * 2
    return store_cell(out, method=method, seed=seed, status=status, curve=rising(0.0, final), evaluation=evaluation)


def make_results(out: Path) -> None:
    """Write three seeds each of two methods, all of one tool."""
    for seed in range(3):
        make_cell(out, "gnn_ppo", seed, 2.0)
        make_cell(out, "cma_rl", seed, 1.0)


def claim(name: str, finding: Finding | None) -> Claim:
    """Return a claim that comes out as `finding`, or lacks data where it is None."""

    def found(evidence: Evidence, rng: np.random.Generator) -> Finding:
        if finding is None:
            raise InsufficientData("nothing there")
        return finding

    return Claim(
        name, f"sentence of {name}", "section", Rule("kind", "number", "words", ("make {results}{profile}",), found)
    )


def test_verify_prints_and_writes_a_row_for_each_claim(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results, out = tmp_path / "runs", tmp_path / "claims"
    make_results(results)
    assert main(["verify", "--results", str(results), "--out", str(out)]) == 0
    printed = capsys.readouterr().out.splitlines()
    rows = {line.split()[1]: line for line in printed if line.split()[0] in VERDICTS}
    assert set(rows) == {claim.name for claim in CLAIMS if set(claim.tasks) <= {"push"}}
    assert (
        " ".join(rows["final_return.push.cma_rl"].split()[:5]) == "supported final_return.push.cma_rl 1.00 [1.00, 1.00]"
    )
    assert rows["steps.push.cma_rl"].split()[2] == "0.50"
    assert rows["tools_vary.push"].startswith("contradicted")
    assert rows["final_return.push.cma_es"].startswith("undecided")
    assert printed[-2:] == [str(out / "claims.json"), str(out / "claims.md")]

    content = json.loads((out / "claims.json").read_text())
    written = {row["name"]: row for row in content["claims"]}
    assert set(written) == {claim.name for claim in CLAIMS}
    assert {name for name, row in written.items() if row["verdict"] != NOT_ASKED} == set(rows)
    assert written["final_return.push.cma_rl"]["value"] == pytest.approx(1.0)
    assert written["final_return.push.cma_rl"]["verdict"] == "supported"
    assert written["final_return.push.cma_es"]["value"] is None
    page = (out / "claims.md").read_text()
    assert {claim.name for claim in CLAIMS if claim.sentence in page} == set(rows)


def test_missing_data_are_named_with_the_command_that_makes_them_alike(tmp_path: Path) -> None:
    make_results(tmp_path)
    rows = {row.claim.name: row for row in judge(CLAIMS, load_evidence(tmp_path), str(tmp_path))}
    lacking = rows["final_return.push.cma_es"]
    assert lacking.finding.note == "0 finished seeds of push/cma_es/default; 3 are needed"
    (command,) = lacking.needs
    assert command == f"codesign-bench run --method all --task push --seeds 6 --profile quick --out {tmp_path}"
    assert rows["final_return.push.cma_rl"].needs == ()


def test_the_commands_for_missing_data_are_understood(tmp_path: Path) -> None:
    make_results(tmp_path)
    whatever_the_task = [replace(claim, tasks=()) for claim in ALL_CLAIMS]
    commands = missing(judge(whatever_the_task, load_evidence(tmp_path), str(tmp_path)))
    assert len(commands) == len(set(commands)) > 5
    for command in commands:
        assert build_parser().parse_args(command.split()[1:]).command


def test_claims_of_each_verdict_are_counted_and_told() -> None:
    claims = [
        claim("one", Finding(SUPPORTED, 1.0, 0.5, 1.5, n="3 seeds", note="so be it")),
        claim("two", Finding(UNDECIDED, 2.0, 0.0, float("inf"), n="3 seeds")),
        claim("three", None),
    ]
    rows = judge(claims, Evidence(), "here")
    assert summary(rows) == "3 claims: 1 supported, 0 contradicted, 2 undecided (1 of them for lack of data)"
    assert [row.interval for row in rows] == ["1.00 [0.50, 1.50]", "2.00 [0.00, never]", "-"]
    assert missing(rows) == ["make here"]
    study = study_of(claims)
    page = as_markdown(rows, study, Path("here"))
    assert "| sentence of one | *supported* | 1.00 [0.50, 1.50] | 3 seeds | kind | section | so be it |" in page
    assert "nothing there; needs: `make here`" in page
    assert "| kind | 1 | 0 | 2 |" in page
    assert "## Contradicted\n\nNone.\n" in page
    one, two, three = as_json(rows, study, Path("here"))["claims"]
    assert (one["value"], one["low"], one["high"]) == (1.0, 0.5, 1.5)
    assert (two["high"], three["value"], three["needs"]) == ("inf", None, ["make here"])


def test_what_is_contradicted_is_listed_with_its_number() -> None:
    claims = [claim("one", Finding(CONTRADICTED, 0.25, 0.2, 0.3, n="3 seeds"))]
    page = as_markdown(judge(claims, Evidence(), "here"), study_of(claims), Path("here"))
    assert "- sentence of one: 0.25 [0.20, 0.30] (3 seeds)\n" in page


def test_a_claim_about_a_task_without_results_is_not_asked() -> None:
    asked = claim("asked", Finding(SUPPORTED, 1.0))
    elsewhere = replace(claim("elsewhere", Finding(SUPPORTED, 1.0)), tasks=("weave",))
    rows = judge([asked, elsewhere], Evidence(), "here")
    assert [row.finding.verdict for row in rows] == [SUPPORTED, NOT_ASKED]
    assert summary(rows) == (
        "1 claims: 1 supported, 0 contradicted, 0 undecided (0 of them for lack of data); "
        "1 more not asked, without results of all of weave"
    )
    assert missing(rows) == []
    assert "sentence of elsewhere" not in as_markdown(rows, study_of([asked, elsewhere]), Path("here"))


def test_a_new_claim_moves_no_other_interval() -> None:
    def drawn(evidence: Evidence, rng: np.random.Generator) -> Finding:
        return Finding(UNDECIDED, float(rng.random()))

    first, second = (Claim(name, "", "", Rule("", "", "", (), drawn)) for name in ("first", "second"))
    values = [row.finding.value for row in judge([first, second], Evidence(), "")]
    assert values[0] != values[1]
    assert [row.finding.value for row in judge([second], Evidence(), "")] == values[1:]


def test_names_of_claims_are_unique_and_commands_have_their_places() -> None:
    names = [claim.name for claim in ALL_CLAIMS]
    assert len(names) == len(set(names))
    for entry in ALL_CLAIMS:
        assert entry.rule.needs
        assert all("{results}" in command for command in entry.rule.needs)


def test_the_page_on_claims_tells_every_rule_in_the_same_words() -> None:
    page = (ROOT / "docs" / "claims.md").read_text()
    told = set(re.findall(r"^\| (.+) \| (.+) \| (.+) \|$", page, re.MULTILINE))
    assert {(claim.rule.kind, claim.rule.statistic, claim.rule.words) for claim in CLAIMS} <= told


@pytest.mark.reference
@pytest.mark.skipif(not REFERENCE.exists(), reason="a source distribution leaves the results out")
def test_the_shipped_results_decide_what_they_can() -> None:
    rows = {row.claim.name: row for row in judge(CLAIMS, load_evidence(REFERENCE), "results/reference")}
    frame = default_rows(load_results(REFERENCE))
    last = frame.sort_values("env_steps").groupby(["task", "method", "seed"])["return_mean"].last()
    means, seeds = last.groupby(["task", "method"]).mean(), last.groupby(["task", "method"]).size()
    compared = [f"final_return.{task}.cma_rl" for task, method in means.index if method == "cma_rl"]
    assert compared
    for name in compared:
        task, finding = name.split(".")[1], rows[name].finding
        assert finding.value == pytest.approx(means[task, "gnn_ppo"] - means[task, "cma_rl"], abs=1e-9)
        assert finding.n == f"{seeds[task, 'gnn_ppo']} and {seeds[task, 'cma_rl']} seeds"
    decided = {name for name, row in rows.items() if not row.needs}
    assert {f"no_single_tool.{table.stem}" for table in REFERENCE.glob("design_sensitivity/*.csv")} <= decided


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (
            lambda folder: (folder / "evaluation.csv").write_text("somebody,else\n1,2\n"),
            "values of 'return' are missing",
        ),
        (lambda folder: (folder / "evaluation.csv").write_text('a,b\n1,2,3\n"'), "cannot read a table"),
        (lambda folder: (folder / "evaluation.csv").write_text(""), "cannot read a table"),
    ],
)
def test_damaged_results_are_refused_in_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], damage: Any, told: str
) -> None:
    make_results(tmp_path)
    damage(tmp_path / "push" / "gnn_ppo" / "default" / "seed-01")
    assert main(["verify", "--results", str(tmp_path), "--out", str(tmp_path / "claims")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


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


def test_unfinished_and_failed_cells_do_not_count(tmp_path: Path) -> None:
    make_results(tmp_path)
    make_cell(tmp_path, "gnn_ppo", 3, 99.0, status=FAILED)
    make_cell(tmp_path, "gnn_ppo", 4, 99.0, status=RUNNING)
    assert load_evidence(tmp_path).final_returns("push", "gnn_ppo").tolist() == [2.0, 2.0, 2.0]
