"""The table of hyperparameters says what configurations say, digit for digit as the paper prints it."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.method import load_method
from codesign_bench.studies.corl2023.hyperparameters import SCENE, as_text, hyperparameters
from codesign_bench.studies.corl2023.learners import LEARNERS
from codesign_bench.studies.corl2023.scenes import SCENES


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2e-5, "2e-5"),
        (3e-4, "3e-4"),
        (1.5e-4, "1.5e-4"),
        (0.005, "0.005"),
        (-0.001, "-0.001"),
        (0.0, "0.0"),
        (50000, "50000"),
        (True, "True"),
        (None, "None"),
        ("joint", "joint"),
        ((64, 64, 64), "(64, 64, 64)"),
        ([0.005, 0.05], "(0.005, 0.05)"),
    ],
)
def test_values_are_written_as_the_paper_prints_them(value: Any, text: str) -> None:
    assert as_text(value) == text


@pytest.mark.parametrize("task", SCENES)
def test_the_paper_profile_holds_the_papers_table(task: str) -> None:
    table = hyperparameters(["gnn_ppo"], [task]).set_index(["method", "name"])["paper"]
    for field in fields(LEARNERS[task]):
        assert table["gnn_ppo", field.name] == as_text(getattr(LEARNERS[task], field.name))
    for field in fields(SCENES[task]):
        assert table[SCENE, field.name] == as_text(getattr(SCENES[task], field.name))


def test_every_profile_stands_beside_the_source_of_its_value() -> None:
    table = hyperparameters(["cma_rl"], ["scoop_3d"]).set_index("name")
    laptop = resolve(load_method("cma_rl"), "scoop_3d", "laptop")
    assert table.loc["batch_size", "paper"] == "20000"
    assert table.loc["batch_size", "paper_source"] == "paper, table of baseline hyperparameters"
    assert table.loc["gamma", "laptop"] == str(laptop.method.gamma)
    assert table.loc["gamma", "laptop_source"] == laptop.sources["method.gamma"]


def test_the_tables_need_no_results_when_asked_for_by_name(tmp_path: Path) -> None:
    draw_figures(["hyperparameter_tables"], tmp_path / "none", tmp_path / "figures", print)
    assert {path.suffix for path in (tmp_path / "figures").iterdir()} == {".csv", ".md", ".pdf", ".png", ".tex"}
    table = pd.read_csv(tmp_path / "figures" / "hyperparameter_tables.csv")
    assert table["task"].unique().tolist() == list(SCENES)
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match="can be plotted yet"):
        draw_figures([], tmp_path / "empty", tmp_path / "figures", print)
