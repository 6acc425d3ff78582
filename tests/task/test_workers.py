"""Processes that share work give what one process gives, and end with the process that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.task import load_task, task_names
from codesign_bench.task.simulators import Simulators


def process_and_slots(simulators: Simulators, part: int) -> tuple[int, int, int]:
    """Return the part, the process, and the slots of the simulator that was lent."""
    with simulators.lend(part) as simulator:
        return part, os.getpid(), simulator.num_slots


def test_parts_are_shared_among_other_processes_and_results_come_in_order(toy: None) -> None:
    simulators = Simulators(load_task("toy_reach"))
    parts = [3, 1, 2, 5, 4, 6]
    here = simulators.share(process_and_slots, parts)
    simulators.use_cores(2)
    shared = simulators.share(process_and_slots, parts)
    assert [part for part, _, _ in here] == [part for part, _, _ in shared] == parts
    assert {process for _, process, _ in here} == {os.getpid()}
    assert os.getpid() not in {process for _, process, _ in shared}
    assert len({process for _, process, _ in shared}) <= 2
    assert all(slots >= part for part, _, slots in shared)
    simulators.use_cores(1)
    assert {process for _, process, _ in simulators.share(process_and_slots, parts)} == {os.getpid()}


def test_one_part_alone_is_worked_on_here(toy: None) -> None:
    simulators = Simulators(load_task("toy_reach"))
    simulators.use_cores(2)
    assert simulators.share(process_and_slots, [2])[0][1] == os.getpid()


@pytest.mark.parametrize("name", [name for name in task_names() if load_task(name).max_slots < 100])
def test_an_evaluation_does_not_depend_on_the_cores(name: str) -> None:
    task = load_task(name)
    instances = task.evaluation_instances()[: task.max_slots + 4]  # two parts

    shared = Simulators(task)
    shared.use_cores(2)
    one = evaluate(task, task.script(), instances=instances)
    two = evaluate(task, task.script(), instances=instances, simulators=shared)
    for column, values in vars(one).items():
        np.testing.assert_array_equal(values, getattr(two, column), err_msg=column)


SLEEPER = """
import multiprocessing, os, time
import toy
from codesign_bench.task.simulators import Simulators

def process(simulators, part):
    return os.getpid()

if __name__ == "__main__":
    simulators = Simulators(toy.ToyReach())
    simulators.use_cores(2)
    simulators.share(process, [0, 1])
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
