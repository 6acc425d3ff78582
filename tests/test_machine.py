"""What a record says of the machine is what the machine itself says."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import codesign_bench
from codesign_bench.machine import (
    C_LIBRARY,
    INSTRUCTION_SETS,
    PACKAGES,
    available_cores,
    computes_in_bfloat16,
    host_facts,
    package_versions,
    peak_megabytes,
)

BOUND = pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="this system binds no process to cores")


@BOUND
def test_there_are_no_more_cores_than_this_process_may_use() -> None:
    assert 1 <= available_cores() <= len(os.sched_getaffinity(0))


@BOUND
def test_a_process_that_is_bound_to_one_core_has_one() -> None:
    line = (
        "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); "
        "from codesign_bench.machine import available_cores; print(available_cores())"
    )
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout == "1\n"


def test_versions_are_those_of_what_is_imported() -> None:
    versions = package_versions()
    assert set(versions) == {"python", "codesign_bench", *PACKAGES, C_LIBRARY}
    assert versions["python"] == platform.python_version()
    assert versions["numpy"] == np.__version__
    assert versions["codesign_bench"] == codesign_bench.__version__


def test_looking_up_versions_imports_nothing() -> None:
    line = (
        "import sys; from codesign_bench.machine import package_versions; package_versions(); "
        "print('torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_the_host_is_named_with_its_processor_and_the_threads_of_a_cell() -> None:
    facts = host_facts(threads=3)
    assert (facts["name"], facts["system"]) == (platform.node(), platform.platform())
    assert (facts["cores"], facts["threads"]) == (os.cpu_count(), 3)
    assert facts["cpu"]
    assert facts["architecture"] == platform.machine()
    assert json.loads(json.dumps(facts)) == facts


def test_instruction_sets_are_the_processors_flags_and_settings_those_of_the_environment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lines = subprocess.run(["cat", "/proc/cpuinfo"], capture_output=True, text=True).stdout
    told = [name for name in INSTRUCTION_SETS if f" {name} " in lines.replace("\n", " ")]
    for name in ("ATEN_CPU_CAPABILITY", "MKL_CBWR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    facts = host_facts(threads=1)
    assert facts["instruction_sets"] == told
    assert facts["library_settings"]["OPENBLAS_CORETYPE"] == "Haswell"
    assert not {"ATEN_CPU_CAPABILITY", "MKL_CBWR"} & set(facts["library_settings"])


def test_bfloat16_is_known_by_the_flags_of_the_processor() -> None:
    lines = subprocess.run(["cat", "/proc/cpuinfo"], capture_output=True, text=True).stdout
    told = any(f" {flag} " in f"{line} " for line in lines.splitlines() for flag in ("amx_bf16", "avx512_bf16", "bf16"))
    assert computes_in_bfloat16() == told


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="there is no /proc")
def test_the_peak_counts_workers_that_are_there_and_no_program_that_has_ended() -> None:
    held = "import sys; block = bytearray(b'1' * 100_000_000); print('ready', flush=True); sys.stdin.read()"
    before = peak_megabytes()
    subprocess.run(["true"], check=True)
    assert peak_megabytes() < before + 20.0
    with subprocess.Popen([sys.executable, "-c", held], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as worker:
        assert worker.stdout is not None
        worker.stdout.readline()
        assert 90.0 < peak_megabytes() - before < 300.0
        worker.communicate()
    assert peak_megabytes() < before + 20.0
