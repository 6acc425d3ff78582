"""The sweep of the CMA-ES baseline: successive halving from the paper's best setting on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.figures.source import Request
from codesign_bench.studies.corl2023 import baseline_sweep
from codesign_bench.studies.corl2023.baseline_sweep import KEYS, Plan, load_sweep, settings_of, sweep_baseline
from codesign_bench.studies.corl2023.learners import CMA_ES_SWEEP


def test_the_sweep_starts_with_the_papers_best_and_halves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(baseline_sweep.PLANS, "quick", Plan(settings=6, budget=10))
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
        load_sweep(Request(tmp_path / "runs")), sweep_baseline(tmp_path / "runs", "quick", told.append)
    )
    assert len(told) == before


def test_settings_are_different_points_of_the_papers_grid() -> None:
    settings = settings_of(50)
    assert len({tuple(setting.values()) for setting in settings}) == 50
    assert all(setting["popsize"] in CMA_ES_SWEEP.population_size.tested for setting in settings)
    assert settings == settings_of(50)
    assert settings_of(972)[-1] not in settings_of(971)


def test_a_missing_sweep_says_how_to_make_it(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no sweep in"):
        load_sweep(Request(tmp_path))


def test_one_setting_really_trains() -> None:
    best: dict[str, Any] = {name: swept.best for name, swept in KEYS.items()}
    steps, value = baseline_sweep._judge({**best, "popsize": 10}, 1_000)
    assert steps >= 1_000
    assert value < 1.0
