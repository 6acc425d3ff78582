"""More cores change how long learning takes and nothing else: rollouts in processes, updates in threads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codesign_bench.learning import batches
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.method import Problem, load_method, method_names
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task

MakeLearner = Callable[..., TwoPhaseLearner]
GROUP_SLOTS = 4


@pytest.fixture(autouse=True)
def small_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several groups although batches are small."""
    monkeypatch.setattr(batches, "GROUP_SLOTS", GROUP_SLOTS)


def trained(make_learner: MakeLearner, cores: int, **settings: Any) -> tuple[TwoPhaseLearner, list[dict[str, float]]]:
    """Return a learner after three batches of 16 slots in four groups, and its metrics."""
    learner = make_learner(batch_size=96, **settings)
    learner.use_cores(cores)
    return learner, [learner.train(96)[0].metrics for _ in range(3)]


@pytest.mark.parametrize(("credit", "cores"), [("separate", 3), ("joint", 2)])
def test_no_number_depends_on_the_cores(make_learner: MakeLearner, credit: str, cores: int) -> None:
    one, metrics = trained(make_learner, 1, design_credit=credit)
    more, same = trained(make_learner, cores, design_credit=credit)
    assert len(batches.group_sizes(16, 1_000)) == 4
    assert metrics == same
    for name, array in one.state().arrays.items():
        np.testing.assert_array_equal(array, more.state().arrays[name], err_msg=name)
    assert one.streams.state() == more.streams.state()


@pytest.mark.usefixtures("toy")
@pytest.mark.parametrize("name", method_names())
def test_no_method_depends_on_the_cores(name: str) -> None:
    method_class = load_method(name)
    policies = []
    for cores in (1, 2):
        config: Any = method_class.config_class(**method_class.small())
        method = method_class(Problem(load_task("toy_reach")), config, Streams(0))
        method.use_cores(cores)
        method.train(96)  # Five groups at least, where a method rolls out in groups.
        policies.append(method.policy().tensors())
    for key, array in policies[0].items():
        np.testing.assert_array_equal(array, policies[1][key], err_msg=key)


SLEEPER = """
import multiprocessing, sys, time
import toy
from codesign_bench.learning.actor import GaussianExplorer
from codesign_bench.learning.rollout_pool import Group, RolloutPool
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams, generator

if __name__ == "__main__":
    method = load_method("shared_arch")
    problem = Problem(toy.ToyReach())
    actor = method.make_actor(problem.task, method.config_class(), generator(0, "weights"))
    RolloutPool(problem, 2).collect(GaussianExplorer(actor), [Group(24, 4, generator(0, str(i))) for i in range(2)])
    print(*(child.pid for child in multiprocessing.active_children()), flush=True)
    time.sleep(600)
"""


def test_worker_processes_end_with_the_process_that_started_them(toy: None, tmp_path: Path) -> None:
    script = tmp_path / "sleeper.py"
    script.write_text(SLEEPER)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        workers = [int(word) for word in process.stdout.readline().split()]
        assert workers
        for worker in workers:
            os.kill(worker, 0)  # Raises if there is no such process.
        process.kill()
        try:
            process.communicate(timeout=120.0)  # The pipe closes when the last process that holds it has ended.
        except subprocess.TimeoutExpired:
            for worker in workers:
                os.kill(worker, signal.SIGKILL)
            pytest.fail("workers outlive the process that started them")
