"""Tables beside the cells are read as they were written, and only results folders get any."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.storage.reading import DamagedFile
from codesign_bench.storage.tables import Content, Form, checksum, csv_bytes, read_table, write_table, write_tables

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


FORM = Form(
    {
        "task": Content.TEXT,
        "seed": Content.WHOLE,
        "return": Content.NUMBER,
        "success": Content.SHARE,
        "instance_*": Content.NUMBER,
    },
    unique=("task", "seed"),
    alike=("task",),
)
GOOD = "task,seed,return,success,instance_x,note\npush,0,1.5,1,0.1,\npush,1,-2,0,0.2,fine\n"


def test_a_table_of_a_form_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(GOOD)
    read = read_table(tmp_path / "a.csv", FORM, checksum(GOOD.encode()))
    assert read is not None
    assert read["return"].tolist() == [1.5, -2.0]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "empty"),
        ("\n", "it has no rows"),
        (GOOD[:-1], "truncated"),
        (GOOD[: GOOD.rindex(",")] + "\n", "row 2 has 5 fields, not 6"),
        ("\ufeff" + GOOD, "byte order mark"),
        (GOOD.replace("fine", "fi\0ne"), "NUL"),
        (GOOD.splitlines(keepends=True)[0], "it has no rows"),
        (GOOD.replace("note", "seed"), "the column 'seed' is there twice"),
        (GOOD.replace("return", "reward"), "it lacks the column 'return'"),
        (GOOD.replace("1.5", "nan"), "row 1 has nothing in the column 'return', which holds finite numbers"),
        (GOOD.replace("1.5", "inf"), "row 1 has 'inf' in the column 'return'"),
        (GOOD.replace("1.5", "1e300"), "row 1 has '1e\\+300' in the column 'return'"),
        (GOOD.replace("1.5", "many"), "row 1 has 'many' in the column 'return'"),
        (GOOD.replace("0.2", ""), "row 2 has nothing in the column 'instance_x'"),
        (GOOD.replace("push,1", "push,-1"), "row 2 has '-1' in the column 'seed', which holds integers from 0"),
        (GOOD.replace("push,1", "push,0.5"), "row 2 has '0.5' in the column 'seed'"),
        (GOOD.replace(",1,0.1", ",2,0.1"), "row 1 has '2' in the column 'success', which holds numbers from 0 to 1"),
        (GOOD.replace("push,1", "push,0"), "row 2 repeats task, seed of an earlier row"),
        (GOOD + '"', "truncated"),
        ("a," * 5000 + "\n1\n", "it has 5001 columns"),
        ("x" * 200_000 + "\n1\n", "field larger than"),
    ],
)
def test_anything_else_is_damaged_and_said_in_one_line(tmp_path: Path, content: str, reason: str) -> None:
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    with pytest.raises(DamagedFile, match=reason) as caught:
        read_table(tmp_path / "a.csv", FORM)
    assert "\n" not in str(caught.value)


def test_groups_of_rows_are_of_the_same_size(tmp_path: Path) -> None:
    form = Form({"goal": Content.WHOLE}, alike=("task", "tool"))
    rows = ["task,tool,goal", *(f"{task},{tool},{goal}" for task in "ab" for tool in (0, 1) for goal in (0, 1))]
    (tmp_path / "a.csv").write_text("\n".join([*rows, "c,0,0"]) + "\n")
    assert read_table(tmp_path / "a.csv", form) is not None, "tasks may have different numbers of goals"
    (tmp_path / "a.csv").write_text("\n".join(rows[:-1]) + "\n")
    with pytest.raises(DamagedFile, match="rows are missing: groups of the same task, tool have different sizes"):
        read_table(tmp_path / "a.csv", form)


def test_a_column_that_rises_does_so_in_every_row(tmp_path: Path) -> None:
    form = Form({"env_steps": Content.WHOLE}, rising="env_steps")
    (tmp_path / "a.csv").write_text("env_steps\n0\n100\n100\n")
    with pytest.raises(DamagedFile, match="'env_steps' does not rise"):
        read_table(tmp_path / "a.csv", form)


def test_a_change_that_no_form_forbids_is_found_by_the_checksum(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(GOOD.replace("1.5", "1.6"))
    assert read_table(tmp_path / "a.csv", FORM) is not None
    with pytest.raises(DamagedFile, match="checksum does not match"):
        read_table(tmp_path / "a.csv", FORM, checksum(GOOD.encode()))


def test_tables_that_belong_together_are_replaced_together(tmp_path: Path) -> None:
    first, second = tmp_path / "runs" / "a.csv", tmp_path / "runs" / "b.csv"
    write_tables(tmp_path / "runs", {first: TABLE})
    second.mkdir()
    with pytest.raises(UserError, match=r"b\.csv is not writable"):
        write_tables(tmp_path / "runs", {first: TABLE[:1], second: TABLE})
    assert len(pd.read_csv(first)) == 2
