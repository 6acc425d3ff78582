"""How far a policy that is played again may stray from what it did elsewhere, episode by episode."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import poisson

from codesign_bench import load_policy
from codesign_bench.evaluation.evaluate import Evaluation, evaluate
from codesign_bench.storage.cells import StoredCell
from codesign_bench.storage.layout import EVALUATION_FILE
from codesign_bench.storage.policies import problem_of

OTHERWISE = 2 / 128
"""This share of a policy's episodes may on average end otherwise on another machine.

Of 30 policies' 3,840 episodes, 4 did on another maker's processor, and up to 5 under other instruction sets; never
more than 3 of one policy's.
"""
CHANCE = 1 / 4_000
"""Of a policy with that average to have more such episodes than are allowed: more than 8 of 128, or 4 of 32."""
ALIKE = 1e-4
"""Half of a policy's episodes get the same return, to this share of it or of one.

Rounding changes actions by some 1e-6, and only some contacts make much more of that.
"""


def assert_plays_as_stored(cell: StoredCell, episodes: int | None = None) -> None:
    """Assert that a stored policy does again what its `evaluation.csv` tells, in the first `episodes`; None: in all."""
    problem, stored = problem_of(cell), pd.read_csv(cell.folder / EVALUATION_FILE).iloc[:episodes]
    instances = problem.evaluation_instances()[:episodes]
    policy = load_policy(cell.folder)
    assert_played_alike(evaluate(problem.task, policy, problem.tradeoff, instances, problem.simulators), stored)


def assert_played_alike(again: Evaluation, stored: pd.DataFrame) -> None:
    """Assert that a policy does again what the rows of its `evaluation.csv` tell, as far as rounding allows."""
    value = stored["return"].to_numpy()
    allowed = float(poisson.isf(CHANCE, OTHERWISE * len(value))) / len(value)
    assert np.median(np.abs(again.returns - value) / np.maximum(1.0, np.abs(value))) < ALIKE
    assert (again.successes != stored["success"]).mean() <= allowed
    # Whatever an episode comes to, it hardly leaves the range of the others.
    assert again.returns.mean() == pytest.approx(value.mean(), abs=allowed * np.ptp(value) + ALIKE)
