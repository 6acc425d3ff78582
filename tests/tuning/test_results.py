"""The files of a search: every setting in every rung, and the winners as `run --tuned` reads them."""

from __future__ import annotations

import json
from dataclasses import replace
from math import nan
from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.study import Tuning
from codesign_bench.tuning.results import check_tables, read_winners, spent, write_table, write_winners
from codesign_bench.tuning.scores import Score
from codesign_bench.tuning.settings import Setting

TUNING = Tuning(methods=("a", "b"), tasks=("t",), settings=2, rungs=2, eta=2)
ONE, TWO = Setting("t", "a", 0, {"rate": 0.5}), Setting("t", "a", 1, {"rate": 0.25})
OTHER = Setting("t", "b", 0, {"size": 8})
SCORES = [
    Score(ONE, 0, 50, 100, 1.0),
    Score(TWO, 0, 50, 102, 9.0),
    Score(OTHER, 0, 50, 101, 2.0),
    Score(TWO, 1, 100, 200, 3.0),
    Score(OTHER, 1, 100, 200, nan),
]


def test_the_table_has_a_row_for_every_setting_and_rung(tmp_path: Path) -> None:
    write_table(tmp_path, TUNING, SCORES, [SCORES[1], SCORES[3]])
    table = pd.read_csv(tmp_path / "tuning.csv")
    assert table["setting"].tolist() == [0, 1, 0, 1, 0]
    assert table["kept"].tolist() == [0, 1, 0, 1, 0]
    assert table["seeds"].tolist() == ["0 1"] * 5
    assert table["rate"].dropna().tolist() == [0.5, 0.25, 0.25]
    assert table["size"].dropna().tolist() == [8.0, 8.0]


def test_tables_are_replaced_by_a_search_that_includes_theirs_alone(tmp_path: Path) -> None:
    check_tables(tmp_path, TUNING)
    write_table(tmp_path, TUNING, SCORES, [])
    check_tables(tmp_path, TUNING)
    check_tables(tmp_path, replace(TUNING, methods=("a", "b", "c")))
    with pytest.raises(UserError, match="has a search for b on t, too: name all of them, or give another --out"):
        check_tables(tmp_path, replace(TUNING, methods=("a", "c")))


@pytest.mark.parametrize("content", ["", "task,method\n1,", "a,b\n1,2\n"])
def test_tables_that_cannot_be_read_are_not_replaced(tmp_path: Path, content: str) -> None:
    (tmp_path / "tuning.csv").write_text(content)
    with pytest.raises(UserError, match=r"cannot read '.*tuning\.csv' \(.+\); give another --out"):
        check_tables(tmp_path, TUNING)
    assert (tmp_path / "tuning.csv").read_text() == content


def test_steps_of_all_rungs_are_added_up() -> None:
    assert spent(SCORES) == {"a": 402, "b": 301}


def test_winners_are_read_as_they_are_written(tmp_path: Path) -> None:
    write_winners(tmp_path, {"study": "s"}, TUNING, SCORES, [SCORES[3]])
    assert read_winners(tmp_path / "tuned.json") == {("t", "a"): ("a.rate=0.25",)}
    content = json.loads((tmp_path / "tuned.json").read_text())
    assert content["study"] == "s"
    assert content["env_steps"] == {"a": 402, "b": 301}
    assert content["tuning"]["settings"] == 2
    assert content["winners"][0]["values"] == {"rate": 0.25}


@pytest.mark.parametrize("content", [None, "{", "[]", '{"winners": [{"task": "t"}]}'])
def test_another_file_is_named(tmp_path: Path, content: str | None) -> None:
    path = tmp_path / "tuned.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(UserError, match=r"cannot read '.*tuned\.json', which `codesign-bench tune` writes"):
        read_winners(path)
