"""The tables of hyperparameters: every value where it belongs, in picture and text."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.registry import load_module

figure: Any = load_module("paper_figs", "hyperparameter_tables")


def row(task: str, method: str, name: str, paper: str, laptop: str, printed: str = "") -> dict[str, str]:
    """Return one hyperparameter; `printed` is what the paper's table has for it."""
    values = {"paper": paper, "laptop": laptop}
    differs = {f"{profile}_differs": "differs" * bool(printed and used != printed) for profile, used in values.items()}
    sources = {"paper_source": "paper, table", "laptop_source": "ours"}
    named = {"task": task, "method": method, "label": method, "name": name, "printed_value": printed}
    return {**named, **values, **sources, **differs}


def settings() -> pd.DataFrame:
    """Return two tasks with a scene, the paper's method and a baseline each."""
    rows = []
    for task in ("scoop", "push"):
        steps = "30" if task == "scoop" else "150"
        rows.append(row(task, "scene", "max_episode_steps", steps, steps, printed="150"))
        rows.append(row(task, "gnn_ppo", "gamma", "0.995", "0.98"))
        rows.append(row(task, "gnn_ppo", "batch_size", "50000", "10000", printed="50000"))
        rows.append(row(task, "gnn_ppo", "design_gnn", "(64, 64, 64)", "(32, 32)", printed="(64, 64, 64)"))
        rows.append(row(task, "cma_rl", "popsize", "24", "24" if task == "push" else "12"))
    return pd.DataFrame(rows)


def pictured() -> list[dict[tuple[int, int], str]]:
    """Return the texts of each table of the picture by row and column."""
    return [
        {place: cell.get_text().get_text() for place, cell in axes.tables[0].get_celld().items()}
        for axes in figure.draw(settings()).axes
    ]


def test_the_picture_holds_the_scene_then_each_profile_over_the_tasks_in_the_papers_order() -> None:
    scene, paper, laptop = pictured()
    assert [scene[0, column] for column in range(3)] == ["scene, in every profile", "push", "scoop"]
    assert [scene[1, column] for column in range(3)] == ["Max Episode Steps", "150", "30 (paper: 150)"]
    assert [paper[1, column] for column in range(3)] == ["Design GNN", "(64, 64, 64)", "(64, 64, 64)"]
    assert [laptop[2, column] for column in range(3)] == ["Batch Size", "10000", "10000"]


def test_long_values_that_differ_stand_in_lines_of_their_own() -> None:
    frame = pd.DataFrame(
        [row("push", "scene", "control_action_min", *2 * ["(-1.0, -1.0)"], printed="(-1.0, -1.0, -0.2, -0.2)")]
    )
    cells = figure.draw(frame).axes[0].tables[0].get_celld()
    assert cells[1, 1].get_text().get_text() == "(-1.0, -1.0)\n(paper: (-1.0, -1.0,\n-0.2, -0.2))"


def test_the_picture_leaves_out_what_the_papers_tables_lack() -> None:
    assert not any("Gamma" in part.values() for part in pictured())


def test_texts_have_a_table_per_scene_with_what_is_printed_and_what_runs_and_where_these_differ() -> None:
    push, _, scoop, *_ = figure.texts(settings())["md"].split("## ")[1:]
    assert push.startswith("push: scene, in every profile")
    assert "| scene | paper | ours |  | source of ours |" in push
    assert "| Max Episode Steps | 150 | 150 |  | paper, table |" in push
    assert "| Max Episode Steps | 150 | 30 | differs | paper, table |" in scoop


def test_texts_have_a_table_per_task_with_the_papers_rows_first() -> None:
    push = figure.texts(settings())["md"].split("## ")[2]
    assert push.startswith("push: gnn_ppo")
    names = [line.split(" | ")[0].strip("| ") for line in push.splitlines() if line.startswith("| ")][2:]
    assert names == ["Design GNN", "Batch Size", "Gamma"]
    assert "| Batch Size | 50000 | 10000 | differs | paper, table | ours |" in push
    assert "| Gamma | 0.995 | 0.98 |  | paper, table | ours |" in push


def test_a_baseline_has_one_table_that_names_the_tasks_with_other_values() -> None:
    texts = figure.texts(settings())
    assert "## cma_rl, on all tasks" in texts["md"]
    assert "| Population Size | 24 | 24 (scoop: 12) |" in texts["md"]
    assert r"Population Size & 24 & 24 (scoop: 12) \\" in texts["tex"]


def test_latex_escapes_what_it_reads() -> None:
    frame = pd.DataFrame([row("push", "gnn_ppo", "fix_std", "True", "50 %")])
    assert r"Fix Design \& Control Std. & True & 50 \%" in figure.texts(frame)["tex"]


def test_data_holds_every_row_with_its_printed_name() -> None:
    table = figure.data(settings())
    assert len(table) == 10
    assert table["task"].tolist() == ["push"] * 5 + ["scoop"] * 5
    assert set(table["printed"]) == {"Max Episode Steps", "Gamma", "Batch Size", "Design GNN", "Population Size"}


def test_what_is_missing_is_named() -> None:
    with pytest.raises(UserError, match="have no rows"):
        figure.data(settings().iloc[:0])
    with pytest.raises(UserError, match="lack the column laptop_source"):
        figure.draw(settings().drop(columns="laptop_source"))
