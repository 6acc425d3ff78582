"""What tests of claims share: evidence made of numbers that can be checked by hand, in frames and on disk."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from builders import rising, store_cell
from codesign_bench.claims.claim import Claim, Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding, InsufficientData
from codesign_bench.storage.records import DONE
from codesign_bench.study.study import Study

TASK, OURS, OTHER = "push", "gnn_ppo", "cma_rl"


def found(rule: Rule, evidence: Evidence) -> Finding:
    """Return what a rule finds."""
    return rule.judge(evidence, np.random.default_rng(0))


def claim(name: str, finding: Finding | None) -> Claim:
    """Return a claim that comes out as `finding`, or lacks data where it is None."""

    def found(evidence: Evidence, rng: np.random.Generator) -> Finding:
        if finding is None:
            raise InsufficientData("nothing there")
        return finding

    return Claim(
        name, f"sentence of {name}", "section", Rule("kind", "number", "words", ("make {results}{profile}",), found)
    )


def study_of(claims: Sequence[Claim]) -> Study:
    """Return a study that has these claims alone."""
    return Study(name="small", title="A small study", question="Is it so?", claims=lambda: claims)


def cells(method: str, variant: str = "default", *, task: str = TASK, **columns: Sequence[object]) -> pd.DataFrame:
    """Return rows of a frame that belong to one method, task and variant."""
    frame = pd.DataFrame(columns)
    return frame.assign(task=task, method=method, variant=variant)


def finals(
    method: str, returns: Sequence[float], variant: str = "default", *, task: str = TASK, success: float = 0.0
) -> pd.DataFrame:
    """Return final evaluations of one instance: seed s reaches `returns[s]`."""
    columns = {"seed": range(len(returns)), "return": returns, "success": [success] * len(returns)}
    return cells(method, variant, task=task, **columns)


def curves(
    method: str,
    returns: Sequence[Sequence[float]],
    variant: str = "default",
    *,
    steps: Sequence[int] = (0, 50, 100),
    task: str = TASK,
    success: Sequence[Sequence[float]] | None = None,
) -> pd.DataFrame:
    """Return learning curves: seed s goes through `returns[s]` at `steps`."""
    seeds = np.repeat(np.arange(len(returns)), len(steps))
    columns = {
        "seed": seeds,
        "env_steps": np.tile(steps, len(returns)),
        "return_mean": np.ravel(returns),
        "success_rate": np.zeros(len(seeds)) if success is None else np.ravel(success),
    }
    return cells(method, variant, task=task, **columns)


def make_cell(out: Path, method: str, seed: int, final: float, status: str = DONE) -> Path:
    """Write a cell of push that rises from 0 to `final`, and return its folder."""
    row = {"return": final, "success": 0, "episode_length": 5, "material": 0.5, "effort": 0.5}
    lengths = {f"design_link_{link}_length": 1.0 for link in (1, 2, 3)}
    angles = {f"design_joint_{joint}_angle": 0.0 for joint in (1, 2)}
    evaluation = [{**row, **lengths, **angles}] * 2
    return store_cell(out, method=method, seed=seed, status=status, curve=rising(0.0, final), evaluation=evaluation)


def make_results(out: Path) -> None:
    """Write three seeds each of two methods, all of one tool: returns of 2, 2.1 and 2.2, and of 1."""
    for seed in range(3):
        make_cell(out, "gnn_ppo", seed, 2.0 + 0.1 * seed)
        make_cell(out, "cma_rl", seed, 1.0)
