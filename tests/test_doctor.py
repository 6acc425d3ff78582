"""What a bug report says: what is installed, what is missing and for what, and nothing about a person."""

from __future__ import annotations

import getpass
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from codesign_bench import doctor
from codesign_bench.machine import PACKAGES
from codesign_bench.registry import names

WITHOUT = """
import sys
for name in {lacking}:
    sys.modules[name] = None
from codesign_bench.cli import main
sys.exit(main(["doctor"]))
"""


def told_without(*lacking: str) -> list[str]:
    """Return what `codesign-bench doctor` prints in a Python that cannot import these packages."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT.format(lacking=lacking)], capture_output=True, text=True, timeout=300, check=True
    )
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def diagnosis() -> dict[str, doctor.Section]:
    return doctor.diagnosis()


def test_versions_are_those_that_are_installed(diagnosis: dict[str, doctor.Section]) -> None:
    assert diagnosis["system"]["python"].startswith(platform.python_version())
    assert set(PACKAGES) <= set(diagnosis["packages"])
    for name in ("numpy", "gymnasium", "torch"):
        assert diagnosis["packages"][name] == version(name)


def test_threads_are_told_as_they_are_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert doctor.diagnosis()["threads"]["OMP_NUM_THREADS"] == "3"
    for name in doctor.THREAD_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    assert "OMP_NUM_THREADS" in doctor.diagnosis()["threads"]["environment"]


def test_nobody_is_named(diagnosis: dict[str, doctor.Section]) -> None:
    lines = " ".join(value for section in diagnosis.values() for value in section.values())
    assert str(Path.home()) not in lines
    assert platform.node() not in lines.split()
    assert getpass.getuser() not in lines.split()


def test_every_member_counts(diagnosis: dict[str, doctor.Section]) -> None:
    count = len(names("studies"))
    assert diagnosis["members"]["studies"] == f"{count} of {count} can be used"


def test_what_is_missing_is_told_for_each_task_and_method() -> None:
    lines = told_without("pybullet", "pybullet_data", "torch")
    assert any(line.split()[:1] == ["fetch_cube"] and "need pybullet" in line for line in lines)
    assert any(line.split()[:1] == ["gnn_ppo"] and "it needs torch" in line for line in lines)
    assert any(line.split()[:1] == ["GPU"] and "torch cannot be imported" in line for line in lines)
    assert not any(line.split()[:1] == ["push"] for line in lines)


REQUIREMENTS = ["numpy >=99", "no-such-package >=2.0", 'numpy; extra == "one"', 'no-such-extra >=1; extra == "two"']


def test_a_package_that_is_missing_or_too_old_is_told_with_what_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "requires", lambda name: REQUIREMENTS)
    found = doctor.packages()
    assert found["numpy"] == f"{version('numpy')} (needed: >=99)"
    assert found["no-such-package"] == "not installed (needed: >=2.0)"


def test_an_extra_is_installed_or_lacks_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "requires", lambda name: REQUIREMENTS)
    assert doctor.extras() == {"one": "installed", "two": "lacks no-such-extra"}
