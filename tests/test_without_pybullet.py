"""In a Python without pybullet, every command does what it can and names what it leaves out, without a traceback."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from builders import VERSION_0_1_0, store_cell

WITHOUT = """
import sys
for name in ("pybullet", "pybullet_data"):
    sys.modules[name] = None
from codesign_bench.cli import main
sys.exit(main(sys.argv[1:]))
"""
NEED_IT = ("fetch_cube", "lift_cup", "scoop_3d")
REASON = "3D tasks need pybullet, which is not installed"
LEFT_OUT = f"left out: {', '.join(NEED_IT)}: {REASON}"
QUICK = ("--profile", "quick", "--steps", "300", "--set", "evaluations=1", "--jobs", "1")
SLOW = pytest.mark.slow


def command(*arguments: object, status: int = 0) -> list[str]:
    """Run `codesign-bench` without pybullet; return the lines that it wrote."""
    line = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=300, check=False)
    text = done.stdout + done.stderr
    assert "Traceback" not in text, text
    assert done.returncode == status, text
    return text.splitlines()


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return results with cells and policies of tasks that need pybullet and of others."""
    out = Path(shutil.copytree(VERSION_0_1_0, tmp_path / "results"))
    shutil.rmtree(out / "toy_reach")
    return out


def test_everything_is_listed() -> None:
    assert set(NEED_IT) <= {line.strip() for line in command("list")}


def test_all_runs_the_rest_and_names_what_it_leaves_out_once(tmp_path: Path) -> None:
    run = ("run", "--method", "cma_es", "--task", "all", *QUICK, "--out", tmp_path)
    lines = command(*run)
    assert [line for line in lines if "pybullet" in line] == [line for line in lines if line.startswith(LEFT_OUT)]
    assert len([line for line in lines if line.startswith(LEFT_OUT)]) == 1
    assert lines[-1] == "all 3 cells done"


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "--method", "cma_es", "--task", "push", "scoop_3d", *QUICK),
        ("run", "--method", "cma_es", "--task", "all,fetch_cube", *QUICK),
        ("render", "--task", "scoop_3d", "--out", "a.gif"),
        ("bench", "tasks", "--task", "scoop_3d"),
        ("bench", "learner", "--task", "scoop_3d"),
        ("reference", "--task", "fetch_cube"),
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_a_task_by_its_name_is_refused_in_one_line(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (line,) = command(*arguments, status=2)
    assert "is not available: " + REASON in line
    assert list(tmp_path.iterdir()) == []


def test_a_configuration_is_shown_all_the_same() -> None:
    lines = command("show", "--method", "cma_es", "--task", "fetch_cube")
    assert any(line.split()[:2] == ["task", "version"] for line in lines)
    assert any(line.split()[:2] == ["run", "steps"] for line in lines)


@SLOW
@pytest.mark.parametrize("name", ["export", "deploy", "render"])
def test_a_policy_of_such_a_task_is_refused_in_one_line(name: str, results: Path, tmp_path: Path) -> None:
    policy = results / "lift_cup" / "gnn_ppo" / "default" / "seed-00"
    (line,) = command(name, "--policy", policy, "--out", tmp_path / "out.gif", status=2)
    assert f"task 'lift_cup' is not available: {REASON}" in line


@SLOW
def test_cells_of_such_tasks_are_still_shown_and_counted(results: Path) -> None:
    lines = command("status", "--results", results)
    assert any(line.startswith("fetch_cube/gnn_ppo/default/seed-00") for line in lines)


@SLOW
def test_every_figure_that_can_be_drawn_is_drawn_and_the_rest_named(results: Path, tmp_path: Path) -> None:
    lines = command("plot", "--results", results, "--out", tmp_path / "figures")
    drawn = {path.stem for path in (tmp_path / "figures").glob("*.png")}
    assert {"learning_curves", "task_gallery", "qualitative_tools", "timing_table", "final_results"} <= drawn
    assert "lift_cup" in "".join(line for line in lines if line.startswith("picture of"))
    timing = pd.read_csv(tmp_path / "figures" / "timing_table.csv")
    assert "lift_cup" in set(timing["task"])


@SLOW
@pytest.mark.parametrize("figure", ["task_gallery", "hyperparameter_tables"])
def test_a_figure_that_needs_no_cells_shows_the_tasks_that_there_are(figure: str, tmp_path: Path) -> None:
    lines = command("plot", figure, "--results", tmp_path, "--out", tmp_path / "figures")
    shown = pd.read_csv(tmp_path / "figures" / f"{figure}.csv")
    assert set(shown["task"]).isdisjoint(NEED_IT)
    assert all(any(name in line and REASON in line for line in lines) for name in NEED_IT)


@SLOW
def test_claims_and_report_are_written(results: Path, tmp_path: Path) -> None:
    command("verify", "--results", results, "--out", tmp_path / "claims")
    command("report", "--results", results, "--out", tmp_path / "report.html")
    assert REASON in (tmp_path / "report.html").read_text()


@SLOW
def test_a_search_and_an_experiment_leave_out_what_cannot_run(tmp_path: Path) -> None:
    assert LEFT_OUT in "\n".join(command("tune", "--plan"))
    assert LEFT_OUT in "\n".join(command("bench", "tasks", "--seconds", "0.1"))


@SLOW
def test_what_needs_another_package_that_is_missing_says_so_in_one_line(results: Path, tmp_path: Path) -> None:
    without = WITHOUT.replace('"pybullet", "pybullet_data"', '"trimesh", "manifold3d", "distributed", "dask"')
    policy = results / "fetch_cube" / "gnn_ppo" / "default" / "seed-00"
    run = ("run", "--method", "cma_es", "--task", "push", *QUICK, "--out", str(tmp_path / "runs"), "--backend", "dask")
    for arguments in (("export", "--policy", str(policy), "--out", str(tmp_path / "tools")), run):
        line = [sys.executable, "-c", without, *arguments]
        done = subprocess.run(line, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 2, done.stderr
        assert "pip install 'codesign-bench[" in done.stderr.splitlines()[-1]
        assert "Traceback" not in done.stderr


def test_a_task_that_is_not_ours_is_left_out_as_well(tmp_path: Path) -> None:
    store_cell(tmp_path, task="of_nobody", curve=[{"env_steps": 0}])
    assert any(line.startswith("of_nobody/") for line in command("status", "--results", tmp_path))
