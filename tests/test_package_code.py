"""The code of another package: a fingerprint of all its files, its commit and its version."""

from __future__ import annotations

import importlib
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from builders import write_files
from codesign_bench.code_version import CodeVersion, code_version
from codesign_bench.package_code import package_code


@pytest.fixture
def sticks(modules: Path) -> Path:
    """Return the folder of a package."""
    write_files(modules / "sticks", {"__init__.py": "", "mass.py": "M = 1\n"})
    return modules / "sticks"


def package(name: str = "sticks") -> CodeVersion:
    """Return the code of a package as it is on disk."""
    package_code.cache_clear()
    return package_code(name)


@pytest.mark.parametrize("name", ["README.md", "other.py", "mass.py", "scene.urdf", "inner/mesh.stl"])
def test_any_file_of_a_package_changes_its_fingerprint(sticks: Path, name: str) -> None:
    before = package()
    write_files(sticks, {name: "A = 1\n"})
    assert package().fingerprint != before.fingerprint


@pytest.mark.parametrize(
    "make",
    [
        lambda sticks: importlib.import_module("sticks.mass"),  # writes bytecode
        lambda sticks: (sticks / ".hidden").write_text("A"),
        lambda sticks: write_files(sticks, {"runs/codesign-bench.json": "{}", "runs/push/curve.csv": "1"}),
        lambda sticks: (sticks / "around").symlink_to(sticks),
    ],
    ids=["bytecode", "hidden", "results", "link"],
)
def test_bytecode_hidden_files_results_and_linked_folders_are_no_code(
    sticks: Path, make: Callable[[Path], Any]
) -> None:
    before = package()
    make(sticks)
    assert package() == before


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git")
def test_a_package_has_its_own_commit_and_not_that_of_a_checkout_around_it(sticks: Path) -> None:
    somebody = ("-c", "user.name=a", "-c", "user.email=a@example.com", "-c", "core.hooksPath=/dev/null")

    def git(*arguments: str) -> str:
        command = ["git", *somebody, *arguments]
        return subprocess.run(command, cwd=sticks.parent, check=True, capture_output=True, text=True).stdout.strip()

    git("init")
    assert package().commit is None, "nothing of it is in the checkout"
    git("add", ".")
    git("commit", "--message", "one")
    assert (package().commit, package().changed) == (git("rev-parse", "HEAD"), False)
    (sticks / "scene.urdf").write_text("<robot/>")
    assert package().changed is True


def test_what_is_installed_has_a_version_and_what_is_not_has_none(sticks: Path) -> None:
    assert package("pytest").version == pytest.__version__
    assert package().version is None


def test_codesign_bench_is_the_code_that_runs() -> None:
    own, now = package("codesign_bench"), code_version()
    assert (own.version, own.commit, own.fingerprint) == (now.version, now.commit, now.fingerprint)


def test_of_a_single_file_nothing_else_counts(modules: Path) -> None:
    write_files(modules, {"alone.py": "A = 1\n", "beside.py": ""})
    before = package("alone")
    (modules / "beside.py").write_text("B = 1\n")
    assert package("alone") == before
    (modules / "alone.py").write_text("A = 2\n")
    assert package("alone") != before
