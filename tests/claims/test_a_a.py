"""A method against itself: rules that compare methods find a difference in at most one split of its seeds in twenty."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from codesign_bench.cell.variant import DEFAULT
from codesign_bench.claims import comparison
from codesign_bench.claims.claim import Claim, Rule
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.finding import LEVEL, UNDECIDED, Finding, InsufficientData
from codesign_bench.claims.judging import Row, adjusted
from codesign_bench.stats import MIN_SEEDS

REFERENCE = Path(__file__).resolve().parents[2] / "results" / "reference"
SPLITS = 400
FIRST, SECOND = "first half", "second half"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.reference,
    pytest.mark.skipif(not REFERENCE.exists(), reason="a source distribution leaves the results out"),
]


@lru_cache
def shipped() -> Evidence:
    """Return the shipped cells, with the method and the variant in place of the method's name."""
    found = load_evidence(REFERENCE)
    parts = (
        frame.assign(method=frame["method"] + "/" + frame["variant"], variant=DEFAULT.name)
        for frame in (found.curves, found.evaluations)
    )
    columns = ["task", "method", "variant", "seed", "env_steps", "return_mean", "return", "success", "success_rate"]
    curves, evaluations = (part[[name for name in columns if name in part]] for part in parts)
    keys = ["task", "method", "variant", "seed"]
    return Evidence(curves, evaluations.groupby(keys, as_index=False)[["return", "success"]].mean())


@lru_cache
def splittable() -> dict[str, dict[str, list[int]]]:
    """Return, per task, the seeds of each method and variant that has enough for two halves that rules take."""
    counted: dict[str, dict[str, list[int]]] = {}
    for (task, method), rows in shipped().evaluations.groupby(["task", "method"]):
        if len(rows) >= 2 * MIN_SEEDS:
            counted.setdefault(str(task), {})[str(method)] = sorted(rows["seed"])
    return counted


def split(rng: np.random.Generator) -> Evidence:
    """Return the seeds of one method and variant, drawn anew for each task, as those of two methods."""
    halves = {}
    for task, methods in splittable().items():
        method = rng.choice(list(methods))
        seeds = rng.permutation(methods[method])
        for place, seed in enumerate(seeds):
            halves[task, method, seed] = FIRST if place < len(seeds) // 2 else SECOND

    def dealt(frame: pd.DataFrame) -> pd.DataFrame:
        keys = list(zip(frame["task"], frame["method"], frame["seed"], strict=True))
        own = frame[[key in halves for key in keys]]
        return own.assign(method=[halves[key] for key in keys if key in halves])

    evidence = shipped()
    return Evidence(dealt(evidence.curves), dealt(evidence.evaluations))


def asked(claim: Claim, evidence: Evidence) -> Row:
    """Return what a claim's rule finds, before any adjustment."""
    try:
        return Row(claim, claim.rule.judge(evidence, np.random.default_rng(0)))
    except InsufficientData as error:
        return Row(claim, Finding(UNDECIDED, math.nan, note=str(error)))


RULES: dict[str, Callable[[Sequence[str]], list[Rule]]] = {
    "final return": lambda tasks: [comparison.final_return_above(task, FIRST, SECOND, ()) for task in tasks],
    "sooner": lambda tasks: [comparison.sooner(task, FIRST, SECOND, ()) for task in tasks],
    "across tasks": lambda tasks: [comparison.ahead_across_tasks(tasks, FIRST, SECOND, ())],
}


@pytest.mark.parametrize("kind", RULES)
def test_a_method_is_hardly_ever_found_to_differ_from_itself(kind: str) -> None:
    rng, rules = np.random.default_rng(0), RULES[kind](list(splittable()))
    claims = [Claim(f"{kind} {number}", "", "", rule) for number, rule in enumerate(rules)]
    alone, families = [], []
    for _ in range(SPLITS):
        evidence = split(rng)
        rows = [asked(claim, evidence) for claim in claims]
        alone.append(np.mean([row.finding.is_directional and row.finding.p < LEVEL for row in rows]))
        families.append(any(row.finding.is_directional for row in adjusted(rows)))
    print(f"{kind}: {np.mean(alone):.1%} of comparisons alone, {np.mean(families):.1%} of families after adjustment")
    assert np.mean(alone) <= 0.05
    assert np.mean(families) <= 0.05
