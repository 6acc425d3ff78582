"""What tests of the rules share: evidence made of numbers that can be checked by hand, and what a rule finds in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from codesign_bench.claims.claim import Rule
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import Finding

TASK, OURS, OTHER = "push", "gnn_ppo", "cma_rl"


def found(rule: Rule, evidence: Evidence) -> Finding:
    """Return what a rule finds."""
    return rule.judge(evidence, np.random.default_rng(0))


def cells(method: str, variant: str = "default", *, task: str = TASK, **columns: Sequence[object]) -> pd.DataFrame:
    """Return rows of a frame that belong to one method, task and variant."""
    frame = pd.DataFrame(columns)
    return frame.assign(task=task, method=method, variant=variant)


def finals(method: str, returns: Sequence[float], variant: str = "default", *, task: str = TASK) -> pd.DataFrame:
    """Return final evaluations of one instance: seed s reaches `returns[s]`."""
    columns = {"seed": range(len(returns)), "return": returns, "success": [0] * len(returns)}
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
