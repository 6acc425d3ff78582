"""`reproduce` runs what an experiment needs once, draws, verifies and reports it."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from codesign_bench.cell.variant import Variant
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.reproduce import reproduce
from codesign_bench.study import Experiment, Grid, Study

SMALL = ("steps=200", "evaluations=2", "fine_tuning_steps=100")
DEFAULTS = Grid(("toy_reach",), ("toy_search",), (0, 1), overrides=SMALL)


def study_of(experiment: Experiment) -> Study:
    """Return a study with one experiment."""
    return Study(name="toys", title="Toys", question="Does it run?", experiments={"toy": experiment})


def run(experiment: Experiment, folder: Path) -> tuple[int, str]:
    """Reproduce an experiment below `folder`; return the exit code and what was printed."""
    console = Console(record=True, width=300, file=io.StringIO())
    code = reproduce(
        study_of(experiment),
        ["toy"],
        profile="laptop",
        results=folder / "runs",
        figures=folder / "figures",
        console=console,
        jobs=1,
    )
    return code, console.export_text()


@pytest.mark.usefixtures("toy")
def test_it_runs_what_is_missing_draws_and_does_nothing_twice(tmp_path: Path) -> None:
    scratch = replace(DEFAULTS, seeds=(0,), variants=(Variant.of(scratch=1),))
    experiment = Experiment(("learning_curves", "fine_tuning"), "ours", ((DEFAULTS,), (scratch,)))
    code, text = run(experiment, tmp_path)
    assert code == 0, text
    for name in ("learning_curves", "fine_tuning"):
        assert (tmp_path / "figures" / f"{name}.png").exists(), text
    assert (tmp_path / "claims" / "claims.md").exists()
    assert "toy_reach" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "2 of them already done" in run(experiment, tmp_path)[1]


@pytest.mark.usefixtures("toy")
def test_what_is_measured_follows_the_cells_and_a_failure_is_said(tmp_path: Path) -> None:
    def measured(results: Path, profile: str, log: Log) -> None:
        assert any(results.glob("toy_reach/toy_search/default/seed-00/policy.safetensors"))
        log(f"measured under {profile}")

    def impossible(results: Path, profile: str, log: Log) -> None:
        raise UserError("no arm here")

    experiment = Experiment(("learning_curves",), "ours", ((DEFAULTS,),), measures=(measured, impossible))
    code, text = run(experiment, tmp_path)
    assert code == 0
    assert "measured under laptop" in text
    assert "measurement of toy left out: no arm here" in text


@pytest.mark.usefixtures("toy")
def test_a_dry_run_lists_the_cells_of_all_stages_and_runs_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    fine = replace(DEFAULTS, seeds=(0,), variants=(Variant.of(finetune=1),))
    console = Console(record=True, width=300, file=io.StringIO())
    experiment = Experiment(("learning_curves",), "ours", ((DEFAULTS,), (fine,)))
    folders = {"results": tmp_path / "runs", "figures": tmp_path / "figures"}
    study, options = study_of(experiment), {"profile": "laptop", "jobs": 1, "only_plan": True}
    assert reproduce(study, ["toy"], console=console, **folders, **options) == 0
    text = console.export_text()
    assert [line.split()[1] for line in text.splitlines() if "/seed-0" in line] == ["run", "run", "run"]
    assert "3 cells, 3 to run" in text
    assert "expected to take" in text
    assert not (tmp_path / "runs").exists()


@pytest.mark.usefixtures("toy")
def test_nothing_drawn_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing can be drawn of toy"):
        run(Experiment(("tradeoff",), "ours"), tmp_path)
