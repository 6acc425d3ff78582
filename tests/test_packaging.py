"""What pip installs is complete: the wheel, alone and outside the checkout, lists what the checkout lists."""

from __future__ import annotations

import configparser
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from oldest_constraints import constraints

ROOT = Path(__file__).resolve().parent.parent
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.y*ml"))
SCRIPTS = sorted((ROOT / ".ci").glob("*"))
LEFT_OUT = shutil.ignore_patterns(".*", "*.egg-info", "build", "dist", "__pycache__", "results")


def run(*arguments: str, folder: Path, path: Path | None = None) -> str:
    """Run Python with `arguments` in `folder` and return its output; `path` is searched for modules first."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    if path is not None:
        environment["PYTHONPATH"] = str(path)
    command = [sys.executable, *arguments]
    result = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a clean copy of the checkout: building leaves files behind that must not reach the next build."""
    copy = tmp_path_factory.mktemp("a copy") / "codesign-bench"
    shutil.copytree(ROOT, copy, ignore=LEFT_OUT)
    return copy


@pytest.fixture(scope="module")
def installed(checkout: Path) -> Path:
    """Return a folder into which a wheel built from the copy is installed, without its dependencies."""
    target = checkout.parent / "installed"
    options = ("--no-deps", "--no-build-isolation", "--quiet", "--target", str(target))
    run("-m", "pip", "install", *options, str(checkout), folder=checkout.parent)
    return target


def modules(folder: Path) -> set[str]:
    """Return the Python files below a folder, as paths relative to it."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*.py")}


def test_the_installed_package_holds_every_module(installed: Path) -> None:
    expected = {f"codesign_bench/{name}" for name in modules(ROOT / "codesign_bench")}
    for folder in ("methods", "tasks", "paper_figs"):
        expected |= {f"codesign_bench/{folder}/{name}" for name in modules(ROOT / folder)}
    assert modules(installed / "codesign_bench") == {name.removeprefix("codesign_bench/") for name in expected}
    for name in ("py.typed", "report/templates/page.html.j2", "report/templates/style.css"):
        assert (installed / "codesign_bench" / name).is_file()


def test_nothing_lands_beside_the_package(installed: Path) -> None:
    names = {path.name for path in installed.iterdir() if not path.name.endswith(".dist-info")}
    assert names <= {"codesign_bench", "bin"}


def test_the_command_works_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    where = run("-c", "import codesign_bench; print(codesign_bench.__file__)", folder=tmp_path, path=installed)
    assert Path(where.strip()).is_relative_to(installed), "the checkout was tested, not what is installed"
    listing = run("-m", "codesign_bench", "list", folder=tmp_path, path=installed)
    for folder in ("methods", "tasks", "paper_figs"):
        for name in (path.stem for path in (ROOT / folder).glob("[a-z]*.py")):
            assert name in listing


def test_the_build_has_no_warning_of_a_folder_that_is_not_declared(checkout: Path, tmp_path: Path) -> None:
    build = "import setuptools.build_meta as backend, sys; backend.build_wheel(sys.argv[1])"
    command = [sys.executable, "-c", build, str(tmp_path)]
    done = subprocess.run(command, cwd=checkout, capture_output=True, text=True, timeout=300, check=True)
    said = done.stdout + done.stderr
    assert "page.html.j2" in said, "the build tells nothing: the test shows nothing"
    assert "absent from the" not in said
    assert "eprecat" not in said


ACTION = re.compile(r"(- )?uses: [\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")


PUBLISHING = {"pages.yml": ("permissions:", "pages: write", "id-token: write")}
"""What the last job of a workflow may do in addition to reading, where it publishes the site."""


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_may_only_read_and_pins_its_actions_by_commit(workflow: Path) -> None:
    lines = workflow.read_text().splitlines()
    top = lines.index("permissions:")
    assert lines[top + 1 : top + 3] == ["  contents: read", ""]
    may = [line.strip() for line in lines if re.fullmatch(r"\s*([\w-]+: write|permissions:)", line)]
    assert may == ["permissions:", *PUBLISHING.get(workflow.name, ())]
    used = [line.strip() for line in lines if "uses:" in line]
    assert used
    assert [line for line in used if not ACTION.fullmatch(line)] == []
    assert sum("persist-credentials: false" in line for line in lines) == sum("checkout@" in line for line in used)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_what_a_workflow_runs_exists_and_may_be_run(script: Path) -> None:
    assert os.access(script, os.X_OK)
    assert any(f".ci/{script.name}" in workflow.read_text() for workflow in WORKFLOWS)


def test_the_oldest_releases_are_those_of_the_lower_bounds() -> None:
    setup = configparser.ConfigParser()
    setup.read(ROOT / "setup.cfg")
    required = setup["options"]["install_requires"].strip().splitlines()
    assert all(" >=" in line for line in required)
    pins = constraints()
    assert [line.replace(" >=", "==", 1) for line in required] == pins[: len(required)]
    assert any(pin.startswith("pytest==") for pin in pins), "extras count, too"


@pytest.mark.slow
def test_the_source_archive_builds_the_same_wheel(checkout: Path) -> None:
    pytest.importorskip("build")
    run("-m", "build", "--no-isolation", "--outdir", "dist", ".", folder=checkout)
    (archive,) = (checkout / "dist").glob("*.tar.gz")
    (wheel,) = (checkout / "dist").glob("*.whl")
    with tarfile.open(archive) as content:
        names = {name.split("/", 1)[-1] for name in content.getnames()}
    for expected in (
        "tests/test_packaging.py",
        "tests/third_party/setup.cfg",
        "Makefile",
        "constraints.txt",
        "LICENSE",
    ):
        assert expected in names
    with zipfile.ZipFile(wheel) as content:
        tops = {name.split("/")[0] for name in content.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"codesign_bench"}
