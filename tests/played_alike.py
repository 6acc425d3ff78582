"""How far a policy that is played again may stray from what it did elsewhere, episode by episode."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from codesign_bench.evaluation.evaluate import Evaluation

OTHERWISE = 8 / 128
"""At most this share of a policy's episodes may end otherwise on another machine.

Of 30 policies' 3,840 episodes, 4 did on another maker's processor, and up to 5 under other instruction sets; never
more than 3 of one policy's. With a mean of 2 of 128, more than 8 come once in 4,000 times.
"""
ALIKE = 1e-4
"""Half of a policy's episodes get the same return, to this share of it or of one.

Rounding changes actions by some 1e-6, and only some contacts make much more of that.
"""


def assert_played_alike(again: Evaluation, told: pd.DataFrame) -> None:
    """Assert that a policy does again what the rows of its `evaluation.csv` tell, as far as rounding allows."""
    value = told["return"].to_numpy()
    assert np.median(np.abs(again.returns - value) / np.maximum(1.0, np.abs(value))) < ALIKE
    assert (again.successes != told["success"]).mean() <= OTHERWISE
    # Whatever an episode comes to, it hardly leaves the range of the others.
    assert again.returns.mean() == pytest.approx(value.mean(), abs=OTHERWISE * np.ptp(value) + ALIKE)
