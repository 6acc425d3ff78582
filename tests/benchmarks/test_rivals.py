"""What other learners are measured by, where they are installed."""

from __future__ import annotations

import pytest

from codesign_bench.benchmarks.learner import contestants
from codesign_bench.benchmarks.workload import Workload


@pytest.mark.parametrize("name", ["stable_baselines3", "stable_baselines3_ours", "usual_way"])
def test_others_are_measured_where_they_are_installed(name: str) -> None:
    pytest.importorskip(contestants()[name].needs)
    work = Workload(batch_size=200, minibatch_size=100, epochs=1, repeats=1, environments=4)
    speed = contestants()[name].measure(work)
    assert speed.rollout > 0.0
    assert speed.update > 0.0
