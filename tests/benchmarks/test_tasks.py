"""The measurement of a task tells the engine from the rest; how fast anything is, no test asserts."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

from codesign_bench.benchmarks.tasks import HEADER, SCALING_HEADER, Scaling, TaskSpeed, measure_scaling, measure_task
from codesign_bench.cli import main
from codesign_bench.task import Floats, Simulator, Slots, Task, load_task

ENGINE_SECONDS, REST_SECONDS, START_SECONDS = 0.002, 0.001, 0.003


class _Sleeps(Simulator):
    """A simulator whose parts take known times."""

    def begin(self, slots: Slots, instances: Floats) -> None:
        time.sleep(START_SECONDS)
        self.advance(slots)  # Physics that the start of an episode needs.
        self.success[slots] = False

    def build(self, slots: Slots, designs: Floats) -> None:
        pass

    def step(self, slots: Slots, controls: Floats) -> None:
        self.advance(slots)
        time.sleep(REST_SECONDS)

    def advance(self, slots: Slots) -> None:
        time.sleep(ENGINE_SECONDS)


def test_the_engines_share_is_told_from_the_rest_and_from_episode_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    push = load_task("push")

    class Sleepy(type(push)):  # type: ignore[misc]  # a class that is only known here
        horizon = 10

        def make_simulator(self, num_slots: int, refinement: int = 1) -> Simulator:
            return _Sleeps(num_slots, self.state_space.size)

    def load(name: str) -> Task:
        return Sleepy()

    monkeypatch.setattr("codesign_bench.benchmarks.tasks.load_task", load)
    speed = measure_task("sleepy", seconds=0.2, slots=4)
    steps, begun = speed.control_steps / 4, -(-speed.control_steps // 40)
    assert ENGINE_SECONDS * steps <= speed.engine < speed.control
    assert speed.control - speed.engine >= REST_SECONDS * steps
    assert speed.starts >= (START_SECONDS + ENGINE_SECONDS) * begun
    assert speed.env_steps == speed.control_steps + 4 * begun


def test_the_printed_numbers_by_hand() -> None:
    speed = TaskSpeed(env_steps=1_100, control_steps=1_000, engine=0.2, control=0.3, starts=0.1)
    # 1,100 steps in 0.4 s; 0.3 s / 1,000 = 300 us; 200 us; 1.5; a quarter.
    assert speed.row == ("2,750", "300.0", "200.0", "1.50", "25 %")


def test_the_printed_scaling_by_hand() -> None:
    assert Scaling(cores=8, one=1_000.0, several=6_000.0).row == ("1,000", "6,000", "6.00", "0.75")


@pytest.mark.usefixtures("toy")
def test_batches_of_random_episodes_are_played_on_one_core_and_on_several() -> None:
    found = measure_scaling(load_task("toy_reach"), seconds=0.01, cores=2)
    assert found.cores == 2
    assert found.one > 0.0
    assert found.several > 0.0


@pytest.mark.usefixtures("toy")
def test_the_numbers_go_to_a_file_with_the_conditions_they_were_measured_under(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "speed.json"
    arguments = ["--task", "toy_reach", "--seconds", "0.01", "--cores", "2", "--out", str(out)]
    assert main(["bench", "tasks", *arguments]) == 0
    assert SCALING_HEADER[2].format(cores=2) in capsys.readouterr().out
    content = json.loads(out.read_text())
    assert set(content) == {"tasks", "scaling", "versions", "code", "host"}
    assert content["scaling"]["toy_reach"]["cores"] == 2
    assert content["tasks"]["toy_reach"]["control_steps"] > 0


def test_the_command_prints_a_row_per_task(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "tasks", "--task", "push", "--seconds", "0.1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    header = next(line for line in lines if line.startswith(HEADER[0]))
    assert all(name in header for name in HEADER)
    row = lines[lines.index(header) + 1].split()
    assert row[0] == "push"
    assert np.isfinite(float(row[4]))
