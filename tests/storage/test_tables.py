"""Tables beside the cells are read as they were written, and only results folders get any."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.storage.tables import csv_bytes, read_table, write_table

TABLE = pd.DataFrame({"task": ["push", "scoop"], "return": [1.0 / 3.0, 0.1 + 0.2]}, index=[5, 7])


def test_a_table_is_the_same_bytes_on_every_system_without_the_numbers_of_its_rows() -> None:
    assert csv_bytes(TABLE.assign(**{"return": [0.5, 2.0]})) == b"task,return\npush,0.5\nscoop,2.0\n"


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "runs" / "outside_region" / "push.csv"
    write_table(tmp_path / "runs", path, TABLE)
    read = read_table(path)
    assert read is not None
    assert read.to_dict("list") == TABLE.to_dict("list")
    write_table(tmp_path / "runs", path, TABLE[:1])
    assert len(pd.read_csv(path)) == 1


def test_where_there_is_no_table_there_is_none(tmp_path: Path) -> None:
    assert read_table(tmp_path / "push.csv") is None


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "chapter.tex").write_text("")
    with pytest.raises(UserError, match=str(tmp_path)):
        write_table(tmp_path, tmp_path / "design_sensitivity" / "push.csv", TABLE)
    assert [found.name for found in tmp_path.iterdir()] == ["chapter.tex"]
