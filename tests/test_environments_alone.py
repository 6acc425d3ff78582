"""Environments need no more than `requirements-envs.txt` names: not PyTorch, nor what only training and figures use."""

from __future__ import annotations

import configparser
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("packaging")
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
MODULES = {"scikit-learn": "sklearn", "pillow": "PIL"}
"""Package -> its module, where that has another name."""
PLAY = """
import sys
for name in {blocked}:
    sys.modules[name] = None
import codesign_bench, gymnasium
from codesign_bench.cli import main
for name in [name for name in gymnasium.registry if name.startswith("codesign_bench/")]:
    env, envs = gymnasium.make(name), gymnasium.make_vec(name, num_envs=2)
    for each in (env, envs):
        each.reset(seed=0)
        for _ in range(3):
            each.step(each.action_space.sample())
        each.close()
    print("played", name)
assert main(["list"]) == main(["doctor"]) == 0
"""


def dependencies() -> list[str]:
    setup = configparser.ConfigParser()
    setup.read(ROOT / "setup.cfg")
    return setup["options"]["install_requires"].strip().splitlines()


def of_environments() -> list[str]:
    lines = (ROOT / "requirements-envs.txt").read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def test_they_are_dependencies_with_the_same_ranges() -> None:
    assert set(of_environments()) < set(dependencies())


def test_environments_work_where_nothing_else_can_be_imported() -> None:
    needed = {Requirement(line).name for line in of_environments()}
    others = {Requirement(line).name for line in dependencies()} - needed
    assert "torch" in others
    blocked = sorted(MODULES.get(name, name) for name in others)
    done = subprocess.run(
        [sys.executable, "-c", PLAY.format(blocked=blocked)], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert sum(line.startswith("played codesign_bench/") for line in done.stdout.splitlines()) >= 6


@pytest.mark.parametrize("system", ["linux", "darwin", "win32"])
@pytest.mark.parametrize("machine", ["x86_64", "aarch64", "arm64", "AMD64"])
@pytest.mark.parametrize("python", ["3.10", "3.11", "3.12", "3.13", "3.14"])
def test_at_most_one_package_brings_pybullet(system: str, machine: str, python: str) -> None:
    place = {"sys_platform": system, "platform_machine": machine, "python_version": python}
    bullets = [each for line in dependencies() if (each := Requirement(line)).name.startswith("pybullet")]
    chosen = [each.name for each in bullets if each.marker is not None and each.marker.evaluate(place)]
    assert len(chosen) <= 1
    if system == "linux" and python in ("3.10", "3.11"):
        assert chosen == ["pybullet"]
    if python in ("3.12", "3.13") and (system != "linux" or machine == "x86_64"):
        assert chosen == ["pybullet-arm64"]
