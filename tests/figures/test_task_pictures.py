"""Pictures of tasks: a moment in the middle of an episode of the task's script."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builders import store_cell
from codesign_bench.errors import UserError
from codesign_bench.figures.drawing import draw_figures
from codesign_bench.figures.source import Request
from codesign_bench.figures.task_pictures import tasks_at_work
from codesign_bench.storage.records import RUNNING
from codesign_bench.task import load_task


def test_the_picture_is_of_a_moment_after_the_start_and_before_the_end(tmp_path: Path) -> None:
    store_cell(tmp_path)
    row = tasks_at_work(Request(tmp_path)).iloc[0]
    task = load_task("push")
    assert (row["title"], row["success"]) == ("Push", 1)
    assert row["step"] == round(0.6 * row["steps"])
    start = task.make_simulator(1)
    start.begin(np.array([0]), task.evaluation_instances()[row["instance"]][None])
    assert row["picture"].shape == start.render(0).shape
    assert not np.array_equal(row["picture"], start.render(0))


@pytest.mark.usefixtures("toy")
def test_a_task_without_script_or_picture_is_left_out_by_name(tmp_path: Path) -> None:
    logged: list[str] = []
    store_cell(tmp_path, task="toy_reach")
    with pytest.raises(UserError, match="none of the tasks has both"):
        tasks_at_work(Request(tmp_path, logged.append))
    assert logged == ["picture of toy_reach left out: task 'toy_reach' has no script"]


def test_unless_asked_for_by_name_the_gallery_holds_the_tasks_of_the_results(tmp_path: Path) -> None:
    store_cell(tmp_path / "runs", status=RUNNING)
    draw_figures([], tmp_path / "runs", tmp_path / "figures", lambda line: None)
    assert pd.read_csv(tmp_path / "figures" / "task_gallery.csv")["task"].tolist() == ["push"]
