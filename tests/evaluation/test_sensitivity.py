"""How much the tool decides: measured once, kept, and played the way the figure says.

Shapes: `K` tools, `G` goals.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.evaluation import sensitivity
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.evaluation.sensitivity import COLUMNS, load_sensitivity, measure, measure_missing, tools_of
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.task import load_task
from codesign_bench.task.behaviours import GivenDesigns


def test_every_tool_meets_every_goal_and_only_the_tool_differs() -> None:
    table = measure("push", random_tools=5, goals=3)
    assert tuple(table.columns) == COLUMNS
    assert len(table) == (5 + 3) * 3
    assert table.groupby(["tool", "goal"]).size().eq(1).all()
    assert (table["kind"] == "random").sum() == 5 * 3
    assert table.loc[table["own"] == 1, ["tool", "goal"]].to_numpy().tolist() == [[5, 0], [6, 1], [7, 2]]
    task = load_task("push")
    goals = task.evaluation_instances()[:3]
    own = evaluate(task, task.script(), instances=goals)
    np.testing.assert_allclose(table.loc[table["own"] == 1, "return"], own.returns)
    third = evaluate(task, GivenDesigns(tools_of(task, goals, 5)[2:3], task.script()), instances=goals[1:2])
    row = table[(table["tool"] == 2) & (table["goal"] == 1)].iloc[0]
    assert row["outcome"] == pytest.approx(third.outcomes[0])
    assert row["outcome_unit"] == "m"


def test_the_table_does_not_depend_on_the_number_of_processes() -> None:
    alone, two = (measure("push", random_tools=4, goals=16, jobs=jobs) for jobs in (1, 2))
    assert alone.equals(two)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few tools and goals, and push alone."""
    monkeypatch.setattr("codesign_bench.task.task_names", lambda: ("push",))
    original = measure
    monkeypatch.setattr(sensitivity, "measure", lambda name, jobs: original(name, 4, 3, 1))


@pytest.mark.usefixtures("small")
def test_what_is_measured_is_kept_and_never_measured_again(tmp_path: Path) -> None:
    told: list[str] = []
    measure_missing(tmp_path / "runs", ["push"], told.append)
    first = load_sensitivity(tmp_path / "runs")
    path = tmp_path / "runs" / "design_sensitivity" / "push.csv"
    assert str(path) in told[0]
    before = path.read_bytes()
    measure_missing(tmp_path / "runs", ["push"], told.append)
    second = load_sensitivity(tmp_path / "runs")
    assert len(told) == 1
    assert path.read_bytes() == before
    assert first["success"].tolist() == second["success"].tolist()


@pytest.mark.usefixtures("small")
def test_the_figure_is_measured_when_asked_for_by_name_alone(tmp_path: Path) -> None:
    runs, out, told = tmp_path / "runs", tmp_path / "figures", list[str]()
    runs.mkdir()
    with pytest.raises(UserError, match="can be plotted yet"):
        draw_figures([], runs, out, told.append)
    assert "plot design_sensitivity" in "".join(told)
    draw_figures(["design_sensitivity"], runs, out, told.append)
    assert {path.suffix for path in out.glob("design_sensitivity.*")} == {".csv", ".pdf", ".png"}
    draw_figures([], runs, out, told.append)  # Now the results allow it.
