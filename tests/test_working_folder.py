"""The working folder: modules of the user that lie beside the results never run, unless `--import` names them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from codesign_bench.startup import IMPORTS_VARIABLE

TESTS = Path(__file__).parent
NAMES = ("random", "json", "numpy", "torch", "pandas", "pickle", "socket", "struct", "numexpr", "dask", "sitecustomize")
SCRIPT = Path(sys.executable).with_name("codesign-bench")
PROGRAMS = {"script": [str(SCRIPT)], "module": [sys.executable, "-m", "codesign_bench"]}
"""How the program is started. `python -m` itself runs a `codesign_bench.py`, before anything of ours can run."""
MINE = """
from toy import ToyReach, ToySearch

class Mine(ToyReach):
    name = "mine"

class MineSearch(ToySearch):
    name = "mine_search"
"""
RUN = ("--steps", "400", "--seeds", "2", "--out", "runs")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with modules that tell when they run."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'a').write({name!r} + ' ')\n")
    return tmp_path


def ask(program: str, *words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the program in the folder to its end."""
    environment = {**os.environ, "PYTHONPATH": str(TESTS), IMPORTS_VARIABLE: ""}
    environment.pop("PYTHONSAFEPATH", None)
    command = [*PROGRAMS[program], *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="Python 3.10 cannot keep its helpers off the working folder")
@pytest.mark.parametrize(
    ("program", "words"),
    [
        ("script", ("run", "--import", "toy", "--method", "toy_search", "--task", "toy_reach", *RUN)),
        ("module", ("run", "--import", "toy", "--method", "toy_search", "--task", "toy_reach", *RUN)),
        pytest.param(
            *("script", ("run", "--method", "gnn_ppo", "--task", "push", *RUN, "--set", "threads=2")),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("script", ("run", "--import", "toy", "--method", "toy_search", "--task", "toy_reach", *RUN)),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_files_named_like_libraries_are_not_executed(program: str, words: tuple[str, ...], folder: Path) -> None:
    done = ask(program, *words, folder=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "all 2 cells done" in done.stdout
    assert not (folder / "executed").exists(), (folder / "executed").read_text()


def test_the_scripts_own_package_is_not_taken_from_the_folder(folder: Path) -> None:
    (folder / "codesign_bench.py").write_text("raise SystemExit('executed')\n")
    done = ask("script", "list", folder=folder)
    assert done.returncode == 0, done.stderr


def test_a_module_that_is_named_is_found_here_by_every_process_and_no_other_is(folder: Path) -> None:
    (folder / "mine.py").write_text(MINE)
    (folder / "helper.py").write_text("")
    words = ("run", "--import", "mine", "--method", "mine_search", "--task", "mine", *RUN)
    done = ask("script", *words, folder=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "all 2 cells done" in done.stdout
    (folder / "mine.py").write_text("import helper\n" + MINE)
    refused = ask("script", *words, folder=folder)
    assert refused.returncode == 2
    assert "it imports 'helper', which is not found" in refused.stderr
    (folder / "mine.py").write_text("1 / 0\n")
    faulty = ask("script", *words, folder=folder)
    assert (
        faulty.stderr
        == "codesign-bench: --import mine is not available: ZeroDivisionError: division by zero (mine.py, line 1)\n"
    )


def test_a_library_wins_over_a_module_of_the_folder_that_is_named_like_it(folder: Path) -> None:
    done = ask("script", "list", "--import", "json", folder=folder)
    assert done.returncode == 0, done.stderr
    assert not (folder / "executed").exists()
