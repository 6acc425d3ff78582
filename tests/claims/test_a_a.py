"""A method against itself: rules that compare methods find a difference in at most one split of its seeds in twenty."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from codesign_bench.claims import comparison
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.finding import LEVEL, UNDECIDED, Finding, InsufficientData
from codesign_bench.claims.judging import Row, adjusted

REFERENCE = Path(__file__).resolve().parents[2] / "results" / "reference"
METHODS = ("gnn_ppo", "shared_arch", "hwasp_minimal", "cma_rl")
TASKS = ("push", "catch_balls", "scoop", "fetch_cube", "lift_cup")
"""With six seeds each, which split into three and three."""
SPLITS = 400
FIRST, SECOND = "first half", "second half"
KINDS = {
    "final return": [comparison.final_return_above(task, FIRST, SECOND, ()) for task in TASKS],
    "sooner": [comparison.sooner(task, FIRST, SECOND, ()) for task in TASKS],
    "across tasks": [comparison.ahead_across_tasks(TASKS, FIRST, SECOND, ())],
}

pytestmark = [
    pytest.mark.slow,
    pytest.mark.reference,
    pytest.mark.skipif(not REFERENCE.exists(), reason="a source distribution leaves the results out"),
]


@lru_cache
def shipped() -> Evidence:
    """Return the shipped cells that vary nothing."""
    found = load_evidence(REFERENCE)
    parts = (frame[frame["variant"] == "default"] for frame in (found.curves, found.evaluations))
    columns = ["task", "method", "variant", "seed", "env_steps", "return_mean", "return", "success", "success_rate"]
    curves, evaluations = (part[[name for name in columns if name in part]] for part in parts)
    keys = ["task", "method", "variant", "seed"]
    return Evidence(curves, evaluations.groupby(keys, as_index=False)[["return", "success"]].mean())


def split(method: str, rng: np.random.Generator) -> Evidence:
    """Return a method's seeds as those of two methods, dealt out anew on each task."""
    evidence = shipped()
    halves = {
        (task, seed): FIRST if place < 3 else SECOND for task in TASKS for place, seed in enumerate(rng.permutation(6))
    }

    def dealt(frame: pd.DataFrame) -> pd.DataFrame:
        own = frame[(frame["method"] == method) & frame["task"].isin(TASKS)]
        return own.assign(method=[halves[key] for key in zip(own["task"], own["seed"], strict=True)])

    return Evidence(dealt(evidence.curves), dealt(evidence.evaluations))


def asked(claim: Claim, evidence: Evidence) -> Row:
    """Return what a claim's rule finds, before any adjustment."""
    try:
        return Row(claim, claim.rule.judge(evidence, np.random.default_rng(0)))
    except InsufficientData as error:
        return Row(claim, Finding(UNDECIDED, math.nan, note=str(error)))


@pytest.mark.parametrize("kind", KINDS)
def test_a_method_is_hardly_ever_found_to_differ_from_itself(kind: str) -> None:
    rng, rules = np.random.default_rng(0), KINDS[kind]
    claims = [Claim(f"{kind} {number}", "", "", rule) for number, rule in enumerate(rules)]
    alone, families = [], []
    for number in range(SPLITS):
        evidence = split(METHODS[number % len(METHODS)], rng)
        rows = [asked(claim, evidence) for claim in claims]
        alone.append(np.mean([row.finding.is_directional and row.finding.p < LEVEL for row in rows]))
        families.append(any(row.finding.is_directional for row in adjusted(rows)))
    print(f"{kind}: {np.mean(alone):.1%} of comparisons alone, {np.mean(families):.1%} of families after adjustment")
    assert np.mean(alone) <= 0.05
    assert np.mean(families) <= 0.05
