"""Episodes that will be played are counted as they are played, and timed."""

from __future__ import annotations

import pytest

from codesign_bench.evaluation.expected import Work, steps_per_second
from codesign_bench.task import load_task

pytestmark = pytest.mark.usefixtures("toy")


def test_time_follows_from_the_steps_of_whole_episodes() -> None:
    task = load_task("toy_reach")
    work = Work(task, 1_000, steps_per_second=100.0)
    assert work.env_steps == 1_000 * (task.horizon + 1) == 6_000
    assert work.seconds == 60.0
    assert work.line() == "at most 1,000 episodes, 6,000 environment steps, 60 s"


def test_more_processes_than_cores_do_not_help() -> None:
    task = load_task("toy_reach")
    one, many = (Work(task, 1_000, 100.0, jobs).seconds for jobs in (1, 100_000))
    assert many == Work(task, 1_000, 100.0, 1_000_000).seconds
    assert many <= one


def test_a_few_episodes_are_played_to_know_the_speed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([10.0, 12.0])
    monkeypatch.setattr("codesign_bench.evaluation.expected.time.perf_counter", lambda: next(clock))
    task = load_task("toy_reach")
    assert 8.0 <= steps_per_second(task) * 2.0 <= 8 * (task.horizon + 1)  # it has eight instances
