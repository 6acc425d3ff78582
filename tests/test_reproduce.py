"""Experiments say as data which cells they need; `reproduce` runs them once and draws."""

from __future__ import annotations

import io
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from rich.console import Console

from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.registry import names
from codesign_bench.studies.corl2023 import baseline_sweep, experiments
from codesign_bench.studies.corl2023.baseline_sweep import KEYS, Plan, load_sweep, settings_of, sweep_baseline
from codesign_bench.studies.corl2023.experiments import EXPERIMENTS, Experiment, Grid, experiments_named, stages_of
from codesign_bench.studies.corl2023.learners import CMA_ES_SWEEP
from codesign_bench.studies.corl2023.protocol import PROTOCOL
from codesign_bench.study.reproduce import reproduce
from codesign_bench.task import load_task, task_names

REFERENCE = Path(__file__).resolve().parent.parent / "results" / "reference"


def variants(name: str, profile: str = "paper") -> dict[str, int]:
    """Return the seeds of each variant that an experiment needs on one task."""
    cells = [cell for stage in stages_of([EXPERIMENTS[name]], profile) for cell in stage]
    return {variant: len({c.seed for c in cells if c.variant == variant}) for variant in {c.variant for c in cells}}


def test_the_papers_protocol() -> None:
    curves = [cell for stage in stages_of([EXPERIMENTS["learning_curves"]], "paper") for cell in stage]
    assert len(curves) == 5 * 5 * 6 + 5 * 3  # Six seeds on five tasks, three on the sixth.
    assert variants("generalization") == {f"cutout-{share:.2f}": 3 for share in (0.1, 0.2, 0.4, 0.6, 0.8, 0.9)}
    assert variants("tradeoff") == {f"alpha-{alpha:.2f}": 3 for alpha in (0.0, 0.3, 0.7, 1.0)}
    starts = {f"{kind}-{start}": 3 for kind in ("finetune", "scratch") for start in (1, 2, 3, 4)}
    assert variants("fine_tuning") == {"default": 3, **starts}


def test_what_fine_tuning_goes_on_from_is_run_before() -> None:
    first, second = stages_of([EXPERIMENTS["fine_tuning"]], "quick")
    assert {cell.pretrained() for cell in second if cell.finetune is not None} <= set(first)


def test_cells_that_several_experiments_need_are_run_once() -> None:
    stages = stages_of([EXPERIMENTS["timing_table"], EXPERIMENTS["learning_curves"]], "quick")
    cells = [cell for stage in stages for cell in stage]
    assert len(cells) == len(set(cells))
    assert len(stages_of([EXPERIMENTS["learning_curves"]], "quick", seeds=1)[0]) == 6 * 5


def test_tasks_have_what_their_experiments_ask_for() -> None:
    assert set(experiments.ALL_TASKS) == set(task_names())
    assert len(load_task("fetch_cube").fine_tuning_instances()) == len(PROTOCOL.fine_tuning_starts)
    task = load_task("fetch_cube")
    for fraction in PROTOCOL.cutout_fractions:
        assert task.in_cutout(task.evaluation_instances(), fraction).any()


def test_every_figure_is_of_an_experiment_and_may_be_named_instead() -> None:
    for name in names("paper_figs"):
        (experiment,) = experiments_named([name]).values()
        assert name in experiment.figures
    assert list(experiments_named(["final_results", "learning_curves_iqm"])) == ["learning_curves"]


def test_an_experiment_without_cells_ends_well_in_an_empty_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["reproduce", "hyperparameter_tables"]) == 0
    told = capsys.readouterr().out
    assert "hyperparameter_tables.png" in told
    assert "report left out: no results folder" in told


@pytest.mark.usefixtures("toy")
def test_nothing_drawn_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiments, "EXPERIMENTS", {"toy": Experiment(("tradeoff",), "ours")})
    with pytest.raises(UserError, match="nothing can be drawn of toy"):
        reproduce(["toy"], profile="quick", results=tmp_path, figures=tmp_path / "figures", console=Console())


@pytest.mark.skipif(not REFERENCE.exists(), reason="a source distribution leaves the results out")
def test_the_trials_on_an_arm_are_played_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = tmp_path / "runs"
    monkeypatch.setattr(
        experiments, "EXPERIMENTS", {"deployment": replace(EXPERIMENTS["deployment"], stages=(), deploys=("lift_cup",))}
    )
    shutil.copytree(
        REFERENCE / "lift_cup" / "gnn_ppo" / "default" / "seed-00", runs / "lift_cup/gnn_ppo/default/seed-00"
    )

    def run() -> str:
        console = Console(record=True, width=300, file=io.StringIO())
        code = reproduce(
            ["deployment"], profile="laptop", results=runs, figures=tmp_path / "figures", console=console, jobs=1
        )
        assert code == 0
        return console.export_text()

    assert "own-tool-1-trial-1: " in run()
    trials = pd.read_csv(runs / "deployment" / "lift_cup" / "protocol.csv")
    assert len(trials) == 4 * 5
    assert (tmp_path / "figures" / "deployment.png").exists()
    assert "own-tool-1-trial-1: " not in run()


def test_an_unknown_experiment_lists_the_choices(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(experiments_named(["all"])) == list(experiments_named([])) == list(EXPERIMENTS)
    assert main(["reproduce", "figure_7"]) == 2
    assert "unknown experiment 'figure_7'; choose from: task_gallery" in capsys.readouterr().err
    assert main(["reproduce", "tradeoff", "--profile", "slow"]) == 2
    assert main(["reproduce", "tradeoff", "--seeds", "0"]) == 2


@pytest.mark.usefixtures("toy")
def test_it_runs_what_is_missing_draws_and_does_nothing_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small = ("steps=200", "evaluations=2", "fine_tuning_steps=100")
    defaults = Grid(("toy_reach",), ("toy_search",), seeds=2, overrides=small)
    stages = ((defaults,), (replace(defaults, seeds=1, scratches=(1,)),))
    toy = Experiment(("learning_curves", "fine_tuning"), "ours", stages)
    monkeypatch.setattr(experiments, "EXPERIMENTS", {"toy": toy})

    def run() -> tuple[int, str]:
        console = Console(record=True, width=200, file=io.StringIO())
        code = reproduce(
            ["toy"], profile="laptop", results=tmp_path / "runs", figures=tmp_path / "figures", console=console, jobs=1
        )
        return code, console.export_text()

    code, text = run()
    assert code == 0, text
    for name in ("learning_curves", "fine_tuning"):
        assert (tmp_path / "figures" / f"{name}.png").exists(), text
    assert (tmp_path / "claims" / "claims.md").exists()
    assert "toy_reach" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "2 of them done before" in run()[1]


def test_the_sweep_starts_with_the_papers_best_and_halves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(baseline_sweep, "PLANS", {"quick": Plan(settings=6, budget=10)})
    monkeypatch.setattr(baseline_sweep, "_judge", lambda setting, budget: (budget, -abs(setting["sigma0"] - 1.0)))
    told: list[str] = []
    table = sweep_baseline(tmp_path / "runs", "quick", told.append)
    assert table["rung"].value_counts().to_dict() == {0: 6, 1: 2}
    assert table["budget"].tolist() == [10] * 6 + [30] * 2
    assert table["kept"].sum() == 2
    first = table.iloc[0]
    assert {name: first[name] for name in KEYS} == {name: swept.best for name, swept in KEYS.items()}
    assert first["paper_best"] == 1
    kept = table[(table["rung"] == 0) & (table["kept"] == 1)]["return_mean"].min()
    assert kept >= table[(table["rung"] == 0) & (table["kept"] == 0)]["return_mean"].max()
    before = len(told)
    pd.testing.assert_frame_equal(
        load_sweep(tmp_path / "runs"), sweep_baseline(tmp_path / "runs", "quick", told.append)
    )
    assert len(told) == before


def test_settings_are_different_points_of_the_papers_grid() -> None:
    settings = settings_of(50)
    assert len({tuple(setting.values()) for setting in settings}) == 50
    assert all(setting["popsize"] in CMA_ES_SWEEP.population_size.tested for setting in settings)
    assert settings == settings_of(50)
    assert settings_of(972)[-1] not in settings_of(971)


def test_a_missing_sweep_says_how_to_make_it(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="codesign-bench reproduce baseline_sweep"):
        load_sweep(tmp_path)


def test_one_setting_really_trains() -> None:
    best: dict[str, Any] = {name: swept.best for name, swept in KEYS.items()}
    steps, value = baseline_sweep._judge({**best, "popsize": 10}, 1_000)
    assert steps >= 1_000
    assert value < 1.0
