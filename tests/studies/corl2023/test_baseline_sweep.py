"""The sweep of the CMA-ES baseline: successive halving from the paper's best setting on."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from joblib import parallel_config

from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.figures.source import Request
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.studies.corl2023 import baseline_sweep
from codesign_bench.studies.corl2023.baseline_sweep import KEYS, Plan, load_sweep, settings_of, sweep_baseline
from codesign_bench.studies.corl2023.learners import CMA_ES_SWEEP
from codesign_bench.task import load_task

BUDGET = 600


@pytest.fixture
def swept(toy: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, pd.DataFrame, list[str]]:
    """A small sweep on the toy task: the results folder, the table and the messages."""
    monkeypatch.setattr(baseline_sweep, "TASK", "toy_reach")
    monkeypatch.setitem(baseline_sweep.PLANS, "quick", Plan(settings=6, budget=BUDGET))
    messages: list[str] = []
    with parallel_config("sequential"):  # Other processes would sweep on push.
        return tmp_path, sweep_baseline(tmp_path, "quick", messages.append), messages


def trained(setting: dict[str, float], budget: int) -> tuple[int, float]:
    """Return the steps and the final mean return of CMA-ES with a setting of the sweep."""
    method_class, problem = load_method("cma_es"), Problem(load_task("toy_reach"))
    overrides = [f"{name}={value:g}" for name, value in setting.items()]
    config = resolve(method_class, "toy_reach", DEFAULT_PROFILE, overrides)
    method, steps = method_class(problem, config.method, Streams(baseline_sweep.SEED)), 0
    while steps < budget:
        steps += method.train(budget - steps).env_steps
    return steps, float(evaluate(problem.task, method.policy()).returns.mean())


def test_the_sweep_starts_with_the_papers_best_and_halves(swept: tuple[Path, pd.DataFrame, list[str]]) -> None:
    _, table, _ = swept
    assert table["rung"].value_counts().to_dict() == {0: 6, 1: 2}
    assert table["budget"].tolist() == [BUDGET] * 6 + [3 * BUDGET] * 2
    assert table["kept"].sum() == 2
    first = table.iloc[0]
    assert {name: first[name] for name in KEYS} == {name: tested.best for name, tested in KEYS.items()}
    assert table["paper_best"].tolist()[:6] == [1, 0, 0, 0, 0, 0]
    kept, dropped = (table[(table["rung"] == 0) & (table["kept"] == value)] for value in (1, 0))
    assert kept["return_mean"].min() > dropped["return_mean"].max()
    assert set(kept[list(KEYS)].itertuples(index=False)) == set(
        table.loc[table["rung"] == 1, list(KEYS)].itertuples(index=False)
    )


def test_a_setting_is_judged_by_what_training_with_it_gives(swept: tuple[Path, pd.DataFrame, list[str]]) -> None:
    _, table, _ = swept
    for _, row in table.iterrows():
        expected = trained({name: row[name] for name in KEYS}, int(row["budget"]))
        assert (row["env_steps"], row["return_mean"]) == expected


def test_a_finished_sweep_is_read_and_not_made_again(swept: tuple[Path, pd.DataFrame, list[str]]) -> None:
    folder, table, messages = swept
    before = len(messages)
    for again in (load_sweep(Request(folder)), sweep_baseline(folder, "quick", messages.append)):
        pd.testing.assert_frame_equal(again, table)
    assert len(messages) == before


def test_an_interrupted_sweep_resumes_with_the_next_rung(swept: tuple[Path, pd.DataFrame, list[str]]) -> None:
    folder, _, messages = swept
    (stored,) = folder.rglob("*.csv")
    whole = stored.read_bytes()
    first_rung = stored.read_text().splitlines(keepends=True)[: 1 + 6]
    stored.write_text("".join(first_rung))
    with pytest.raises(UserError, match="no sweep in"):
        load_sweep(Request(folder))
    messages.clear()
    with parallel_config("sequential"):
        sweep_baseline(folder, "quick", messages.append)
    assert stored.read_bytes() == whole
    assert len(messages) == 1


@pytest.mark.parametrize("profile", ["quick", "workstation", "mine"])
def test_a_sweep_is_found_whatever_the_profile(profile: str, tmp_path: Path, swept: object) -> None:
    (stored,) = tmp_path.rglob("*.csv")
    name = profile if profile in baseline_sweep.PLANS else DEFAULT_PROFILE
    stored.rename(stored.with_name(f"toy_reach-{name}.csv"))
    found = sweep_baseline(tmp_path, profile, print)
    pd.testing.assert_frame_equal(load_sweep(Request(tmp_path)), found)


def test_another_task_has_a_table_of_its_own(swept: tuple[Path, pd.DataFrame, list[str]]) -> None:
    folder, table, messages = swept
    with parallel_config("sequential"):
        other = sweep_baseline(folder, "quick", messages.append, task="push")
    assert set(other["task"]) == {"push"}
    assert sorted(path.name for path in folder.rglob("*.csv")) == ["push-quick.csv", "toy_reach-quick.csv"]
    pd.testing.assert_frame_equal(load_sweep(Request(folder)), table)


def test_settings_are_different_points_of_the_papers_grid() -> None:
    settings = settings_of(50)
    assert len({tuple(setting.values()) for setting in settings}) == 50
    assert all(setting["popsize"] in CMA_ES_SWEEP.population_size.tested for setting in settings)
    assert settings == settings_of(50)
    assert settings_of(972)[-1] not in settings_of(971)


def test_a_missing_sweep_says_how_to_make_it(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no sweep in"):
        load_sweep(Request(tmp_path))
