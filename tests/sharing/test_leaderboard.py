"""The leaderboard: methods of all archives by score on one scale, with budgets, seeds and tuning beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from builders import rising, store_cell, store_table
from codesign_bench.errors import UserError
from codesign_bench.sharing.leaderboard import OWN, leaderboard
from codesign_bench.sharing.pack import Order, pack
from codesign_bench.storage.measurements import REFERENCE_POINTS
from codesign_bench.storage.reading import DamagedFile
from codesign_bench.text_tables import read_markdown

TASKS = ("push", "scoop")


def submit(folder: Path, name: str, method: str, ends: Sequence[float], best: float, order: Order) -> None:
    """Pack runs of a method with these final returns on every task, and a best known return."""
    runs = folder.parent / f"runs of {name}"
    for task in TASKS:
        for seed, end in enumerate(ends):
            curve = rising(0.0, end)
            store_cell(runs, task=task, method=method, seed=seed, curve=curve, env_steps=1000, label=f"{method}|x")
    points = [
        {"task": task, "point": point, "return_mean": value}
        for task in TASKS
        for point, value in (("idle", 0.0), ("best_known", best))
    ]
    store_table(runs / "reference_points.csv", REFERENCE_POINTS, *points)
    pack(runs, folder / f"{name}.zip", order, lambda line: None)


@pytest.fixture
def archives(tmp_path: Path) -> Path:
    """Return a folder with our archive, a better one, and one with too few seeds."""
    folder, search = tmp_path / "submissions", tmp_path / "search"
    folder.mkdir()
    for task in TASKS:
        store_cell(search, task=task, method="cma_rl", env_steps=5000)
    submit(folder, OWN, "gnn_ppo", (1.0, 2.0, 3.0), 4.0, Order(title="ours", tuning=["by hand"]))
    submit(folder, "better", "cma_rl", (2.0, 3.0, 4.0), 100.0, Order(by="<b>me</b>", tuning=[str(search)]))
    submit(folder, "a-few", "cma_es", (4.0, 4.1), 4.0, Order())
    return folder


def tables(page: str) -> list[tuple[list[str], list[list[str]]]]:
    """Return the tables of a page."""
    parsed = [read_markdown(part) for part in page.split("\n\n")]
    return [table for table in parsed if table is not None]


def test_methods_are_in_the_order_of_their_scores_on_our_scale(archives: Path) -> None:
    (header, rows), *_ = tables(leaderboard(archives, "x"))
    assert header == ["place", "method", "archive", "seeds", "score", "steps a cell", "tuning steps"]
    named = [(row[0], row[2], row[3], row[4].split()[0]) for row in rows]
    assert named == [("1", "better", "3", "0.75"), ("2", OWN, "3", "0.50"), ("-", "a-few", "2", "1.01")]
    assert "[" not in rows[-1][4], "two seeds have no interval"


def test_budgets_are_beside_the_scores(archives: Path) -> None:
    page = leaderboard(archives, "x")
    (_, rows), (_, of_push), *_ = tables(page)
    assert [row[-2:] for row in rows] == [["1,000", "10,000"], ["1,000", "in words below"], ["1,000", "not stated"]]
    assert of_push[0][-2:] == ["1,000", "5,000"]
    assert "## push, version 1" in page
    assert page.index("## push") < page.index("## scoop")


def test_the_archives_are_listed_with_links_and_without_markup(archives: Path) -> None:
    page = leaderboard(archives, "../here")
    assert page.index(f"[{OWN}.zip](../here/{OWN}.zip)") < page.index("[better.zip](../here/better.zip)")
    assert "<b>" not in page
    header, rows = tables(page)[-1]
    assert rows[0][header.index("title")] == "ours"
    assert rows[0][header.index("tuning")] == "by hand"


def test_without_our_archive_there_is_no_scale(archives: Path) -> None:
    (archives / f"{OWN}.zip").unlink()
    with pytest.raises(UserError, match="gives the scale"):
        leaderboard(archives, "x")


def test_a_damaged_archive_and_a_name_that_breaks_links_are_refused(archives: Path) -> None:
    (archives / "better.zip").write_bytes(b"PK")
    with pytest.raises(DamagedFile, match="better"):
        leaderboard(archives, "x")
    (archives / "better.zip").rename(archives / "a](b.zip")
    with pytest.raises(UserError, match="letters"):
        leaderboard(archives, "x")
