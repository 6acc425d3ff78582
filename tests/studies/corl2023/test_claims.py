"""The paper's claims: the shipped results decide what they can."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench.claims.evidence import load_evidence
from codesign_bench.claims.judging import judge
from codesign_bench.storage.frames import default_rows, load_results
from codesign_bench.study.study import load_study

PAPER = load_study("corl2023")
CLAIMS = PAPER.claims()
ROOT = Path(__file__).resolve().parents[3]
REFERENCE = ROOT / "results" / "reference"


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
