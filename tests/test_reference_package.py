"""The package of reference results: data alone, whole, small enough, and found by name where it is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import codesign_bench
from codesign_bench.storage.archive import check_archive, limit_of
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.policies import misfit

ROOT = Path(__file__).resolve().parent.parent
PACKAGE, RESULTS = ROOT / "reference_package", ROOT / "results" / "reference"

if not (PACKAGE.is_dir() and RESULTS.is_dir()):
    pytest.skip("a source distribution leaves the results out", allow_module_level=True)

LARGEST = 100e6
"""Bytes; the index of packages takes no more."""


def python(*arguments: str, folder: Path, path: Path | None = None) -> str:
    """Run Python in `folder` and return its output; `path` is searched for modules first."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment |= {} if path is None else {"PYTHONPATH": str(path)}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_program_and_results_have_the_same_version() -> None:
    assert f'version = "{codesign_bench.__version__}"' in (PACKAGE / "pyproject.toml").read_text()


def test_the_licence_is_that_of_the_program() -> None:
    assert (PACKAGE / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Build the wheel from a copy of the checkout, and a second one from its source archive, and return both."""
    copy = tmp_path_factory.mktemp("checkout")
    shutil.copytree(PACKAGE, copy / PACKAGE.name, ignore=shutil.ignore_patterns("build", "*.egg-info", "reference"))
    shutil.copytree(RESULTS, copy / "results" / "reference")
    line = "import build_data, sys; print(getattr(build_data, sys.argv[1])(sys.argv[2]))"
    for kind in ("build_wheel", "build_sdist"):
        python("-c", line, kind, str(copy / "dist"), folder=copy / PACKAGE.name, path=copy / PACKAGE.name)
    (archive,) = (copy / "dist").glob("*.tar.gz")
    shutil.unpack_archive(archive, copy / "unpacked")
    (source,) = (copy / "unpacked").iterdir()
    python("-c", line, "build_wheel", str(copy / "again"), folder=source, path=source)
    return [*(copy / "dist").glob("*.whl"), *(copy / "again").glob("*.whl")]


@pytest.mark.slow
@pytest.mark.reference
def test_the_wheel_has_the_results_and_nothing_else(wheels: list[Path]) -> None:
    names = []
    for wheel in wheels:
        assert wheel.stat().st_size < LARGEST
        with zipfile.ZipFile(wheel) as opened:
            names.append({name for name in opened.namelist() if ".dist-info/" not in name})
    assert names[0] == names[1], "the source archive gives the same wheel"
    start = "codesign_bench_reference/"
    data = {name.removeprefix(f"{start}reference/") for name in names[0]} - {f"{start}__init__.py", "archive.json"}
    assert [name for name in data if limit_of(name) is None] == []
    cells = {cell.folder.relative_to(RESULTS).as_posix() for cell in find_cells(RESULTS)}
    for kind in ("cell.json", "curve.csv", "evaluation.csv"):
        assert {f"{cell}/{kind}" for cell in cells} <= data
    assert {path.relative_to(RESULTS).as_posix() for path in RESULTS.rglob("policy.safetensors")} <= data
    assert {"reference_points.csv", "best_known/push.csv", "best_known/push.safetensors"} <= data


@pytest.mark.slow
@pytest.mark.reference
def test_an_installed_package_is_found_by_name(wheels: list[Path], tmp_path: Path) -> None:
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    elsewhere.mkdir()
    install = ("-m", "pip", "install", "--no-deps", "--no-index", "--quiet", "--target", str(site), str(wheels[0]))
    python(*install, folder=tmp_path)
    assert check_archive(site / "codesign_bench_reference" / "reference").policies > 0
    fitting = (cell.folder.relative_to(RESULTS) for cell in find_cells(RESULTS) if cell.has_policy and not misfit(cell))
    line = (
        "import codesign_bench as cb; from codesign_bench.storage.places import reference_folder; "
        f"cb.load_policy('reference/{next(fitting).as_posix()}'); "
        "print(reference_folder(), len(cb.load_results('reference')))"
    )
    printed = python("-c", line, folder=elsewhere, path=site).splitlines()[-1]
    assert printed.startswith(str(site / "codesign_bench_reference" / "reference"))
    compared = ("-m", "codesign_bench", "compare", "reference", "reference")
    assert "average of" in python(*compared, folder=elsewhere, path=site)
