"""The command line: what it prints, its exit codes, and bad input answered in two lines at most."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from codesign_bench import method_names, task_names
from codesign_bench.cli import main
from codesign_bench.cli.program import build_parser
from codesign_bench.cli.run import overrides
from codesign_bench.registry import names

pytestmark = pytest.mark.usefixtures("toy")

RUN = ("run", "--method", "toy_search", "--task", "toy_reach", "--steps", "100", "--set", "evaluations=2")


def test_list_names_everything_and_imports_nothing_heavy() -> None:
    program = (
        "import sys; from codesign_bench.cli import main; code = main(['list']); "
        "heavy = [name for name in sys.modules if name.split('.')[0] in ('torch', 'pybullet', 'pymunk', 'cma')"
        " or name.startswith(('codesign_bench.methods.', 'codesign_bench.tasks.', 'codesign_bench.paper_figs.'))]; "
        "sys.exit(f'imported {heavy}' if heavy else code)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    listed = [line.split()[0] for line in done.stdout.splitlines()]
    assert {*method_names(), *task_names(), *names("paper_figs"), "quick", "laptop", "paper"} <= set(listed)


def test_show_tells_the_source_of_every_value(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["show", "--method", "toy_search", "--task", "toy_reach", "--profile", "paper", "--set", "widths=1,2"]
    assert main(arguments) == 0
    rows = {line.split()[1]: line for line in capsys.readouterr().out.splitlines()}
    assert rows["widths"].split(maxsplit=4)[2:] == ["[1,", "2]", "--set"]
    assert rows["step_size"].endswith("toy paper, table 1")
    assert rows["episodes"].endswith("toy paper, table 2")
    assert rows["steps"].endswith("paper, learning curves")


def test_every_built_in_method_can_be_shown(capsys: pytest.CaptureFixture[str]) -> None:
    for method in method_names():
        assert main(["show", "--method", method, "--task", task_names()[0], "--profile", "paper"]) == 0
    assert "paper" in capsys.readouterr().out


def test_run_status_and_plot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results, figures = tmp_path / "runs", tmp_path / "figures"
    assert main([*RUN, "--seeds", "2", "--out", str(results)]) == 0
    assert "all 2 cells done" in capsys.readouterr().out
    assert main(["status", "--results", str(results)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[1].split()[:2] == ["toy_reach/toy_search/default/seed-00", "done"]
    assert told[-1] == "2 cells: 2 done"
    assert main(["plot", "learning_curves", "--results", str(results), "--out", str(figures)]) == 0
    picture = capsys.readouterr().out.splitlines()[-1]
    assert picture == str(figures / "learning_curves.png")
    assert {path.name for path in figures.iterdir()} == {f"learning_curves.{kind}" for kind in ("png", "pdf", "csv")}


def test_status_tells_why_a_cell_failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*RUN, "fail_at=10", "--out", str(tmp_path)]) == 1
    assert main(["status", "--results", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("RuntimeError: the toy broke")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "COMMAND"),
        (["fly"], "fly"),
        (["run", "--method", "gnn", "--task", "toy_reach"], "gnn_ppo"),
        (["run", "--method", "toy_search", "--task", "pull"], "toy_reach"),
        (["run", "--method", ",", "--task", "toy_reach"], "--method"),
        (["run", "--task", "toy_reach"], "--method"),
        ([*RUN, "--profile", "fast"], "quick, laptop, paper"),
        ([*RUN, "speed=1"], "episodes"),
        ([*RUN, "episodes=few"], "expected an integer"),
        ([*RUN, "threads=4096"], "cores"),
        ([*RUN, "--seeds", "0"], "--seeds"),
        ([*RUN, "--seeds", "-1"], "--seeds"),
        ([*RUN, "--seeds=-2,1"], "--seeds"),
        ([*RUN, "--steps", "0"], "--steps"),
        ([*RUN, "--steps", "-5"], "--steps"),
        ([*RUN, "--steps", "many"], "--steps"),
        ([*RUN, "--jobs", "0"], "--jobs"),
        ([*RUN, "--cutout", "1.5"], "--cutout"),
        ([*RUN, "--alpha", "-0.5"], "--alpha"),
        ([*RUN, "--alpha", "nan"], "--alpha"),
        ([*RUN, "--device", "cuda"], "--device"),
        ([*RUN, "--set", "device=cuda"], "--device"),
        ([*RUN, "--device", "abacus"], "cuda"),
        ([*RUN, "--scheduler", "tcp://localhost:1"], "--scheduler goes with --backend dask"),
        ([*RUN, "--backend", "ray"], "--backend"),
        ([*RUN, "--import", "no_such_module"], "no_such_module"),
        (["show", "--method", "toy_search", "--task", "pull"], "toy_reach"),
        (["status", "--results", "no/such/folder"], "no/such/folder"),
        (["plot", "--results", "no/such/folder"], "no/such/folder"),
        (["plot", "no_figure"], "learning_curves"),
    ],
)
def test_bad_input_is_answered_in_two_lines_that_name_it(
    arguments: list[str],
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    told = capsys.readouterr().err.strip()
    assert named in told
    assert told.count("\n") <= 1
    assert not list(tmp_path.glob("results/runs/*/*/*"))


def test_a_foreign_or_unwritable_folder_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.tex").write_text("")
    assert main([*RUN, "--out", str(tmp_path)]) == 2
    assert main([*RUN, "--out", str(tmp_path / "thesis.tex")]) == 2
    assert main([*RUN, "--out", "/proc/runs"]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert len(told) <= 6
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_truncated_checkpoint_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*RUN, "fail_at=50", "--out", str(tmp_path)]) == 1
    checkpoint = next(tmp_path.glob("*/*/*/*/checkpoint.safetensors"))
    checkpoint.write_bytes(checkpoint.read_bytes()[:40])
    capsys.readouterr()
    assert main([*RUN, "fail_at=50", "--retry-failed", "--out", str(tmp_path)]) == 2
    told = capsys.readouterr().err.strip()
    assert str(checkpoint) in told
    assert told.count("\n") <= 1


def test_another_configuration_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*RUN, "--out", str(tmp_path)]) == 0
    assert main([*RUN, "episodes=9", "--out", str(tmp_path)]) == 2
    assert "episodes: stored 4, requested 9" in capsys.readouterr().err


def test_python_dash_m_is_the_same_program() -> None:
    done = subprocess.run([sys.executable, "-m", "codesign_bench", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()[0]) == (0, "codesign-bench")


@pytest.mark.parametrize(
    ("arguments", "has_bfloat16", "expected"),
    [
        (["--method", "gnn_ppo"], True, []),
        (["--method", "gnn_ppo", "--precision", "fp32"], True, ["precision=fp32"]),
        (["--method", "gnn_ppo", "--precision", "auto"], True, ["precision=bf16"]),
        (["--method", "gnn_ppo", "--precision", "auto"], False, ["precision=fp32"]),
        (["--method", "cma_es", "--precision", "auto"], True, []),
        (["--method", "gnn_ppo", "--device", "cpu", "--set", "epochs=2"], True, ["epochs=2", "device=cpu"]),
    ],
)
def test_device_and_precision_are_part_of_the_configuration(
    monkeypatch: pytest.MonkeyPatch, arguments: list[str], has_bfloat16: bool, expected: list[str]
) -> None:
    monkeypatch.setattr("codesign_bench.machine.computes_in_bfloat16", lambda: has_bfloat16)
    options = build_parser().parse_args(["run", "--task", "push", *arguments])
    assert overrides(options) == expected
