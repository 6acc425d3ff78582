"""The measurement of learners counts what it says; how fast anything is, no test asserts."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from codesign_bench.benchmarks import learner
from codesign_bench.benchmarks.learner import HEADER, contestants, operations_per_sample, ours
from codesign_bench.benchmarks.workload import Workload
from codesign_bench.cli import main

SMALL = ["--batch-size", "320", "--minibatch-size", "100", "--epochs", "2", "--repeats", "1"]


def test_updates_in_bfloat16_are_measured_where_the_processor_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for has_it in (True, False):
        monkeypatch.setattr(learner, "computes_in_bfloat16", lambda has_it=has_it: has_it)
        assert ("gnn_ppo_bf16" in contestants()) == has_it


def test_our_learners_are_measured_with_the_papers_networks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "learner.json"
    assert main(["bench", "learner", *SMALL, "--only", "gnn_ppo", "--out", str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    header = next(line for line in lines if line.startswith(HEADER[0]))
    assert lines[lines.index(header) + 1].startswith(contestants()["gnn_ppo"].title)
    content = json.loads(out.read_text())
    assert content["workload"]["batch_size"] == 320
    found = content["learners"]["gnn_ppo"]
    assert found["env_steps_per_second"] == pytest.approx(1.0 / (1.0 / found["rollout"] + 2 / found["update"]))
    assert found["peak_megabytes"] > 50.0


def test_peak_memory_is_the_programs_own_and_not_that_of_the_process_that_started_it() -> None:
    program = "import numpy as np; from codesign_bench.benchmarks.learner import peak_megabytes"
    program += "; np.ones(2**23); print(peak_megabytes())"
    held = np.ones(2**26)
    here = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    # The program holds 64 MB for a moment; it imports nothing that is not imported here, and lacks these 512 MB.
    assert held.nbytes == 2**29
    assert 64.0 < float(done.stdout) < here - 256.0


def test_the_operations_of_a_perceptron_by_hand() -> None:
    work = Workload(batch_size=300, minibatch_size=300, epochs=1, repeats=1)
    per_sample = operations_per_sample("shared_arch", work)
    # Push: 10 state, 2 goal, 5 design, 2 phase inputs; five layers of 256; two numbers out, one value out. A forward
    # pass costs two operations per weight, a backward pass twice that, but no gradient is needed for the inputs.
    inner = 4 * 256 * 256
    weights = (19 * 256 + inner + 256 * 2) + (19 * 256 + inner + 256 * 1)
    expected = 6 * weights - 2 * 2 * 19 * 256
    assert per_sample == pytest.approx(expected, rel=0.02)


def test_the_work_is_counted_per_second() -> None:
    work = Workload(batch_size=320, minibatch_size=160, epochs=1, repeats=1)
    speed = ours("shared_arch")(work)
    assert speed.gigaflops == pytest.approx(speed.update * operations_per_sample("shared_arch", work) / 1e9, rel=0.05)
