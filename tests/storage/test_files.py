"""A file is written whole or not at all, whatever happens in between."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from codesign_bench.storage.files import dump_json, remove_partial_files, replacing, write_bytes, write_json


@pytest.mark.parametrize("durable", [True, False])
def test_a_file_is_replaced(tmp_path: Path, durable: bool) -> None:
    path = tmp_path / "curve.csv"
    for content in (b"old and long", b"new"):
        write_bytes(path, content, durable=durable)
        assert path.read_bytes() == content
    assert [found.name for found in tmp_path.iterdir()] == ["curve.csv"]


def test_the_old_file_stands_until_the_new_one_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    write_bytes(path, b"old")
    with replacing(path) as stream:
        stream.write(b"new")
        stream.flush()
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    write_bytes(path, b"old")

    def fail_half_way() -> None:
        with replacing(path) as stream:
            stream.write(b"ne")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert [(found.name, found.read_bytes()) for found in tmp_path.iterdir()] == [("curve.csv", b"old")]


def test_everybody_may_read_what_was_written(tmp_path: Path) -> None:
    write_bytes(tmp_path / "curve.csv", b"")
    assert (tmp_path / "curve.csv").stat().st_mode & 0o777 == 0o644


def test_what_a_killed_process_left_is_removed_and_nothing_more(tmp_path: Path) -> None:
    for name in (".curve.csv-x1.partial", "notes.partial", ".hidden", "curve.csv"):
        (tmp_path / name).write_text("")
    remove_partial_files(tmp_path)
    assert {found.name for found in tmp_path.iterdir()} == {"notes.partial", ".hidden", "curve.csv"}


def test_numbers_of_numpy_become_plain_ones_and_floats_survive(tmp_path: Path) -> None:
    values = {"count": np.int64(3), "third": np.float64(1.0 / 3.0), "flag": np.bool_(True), "row": np.array([1.5, 2.0])}
    write_json(tmp_path / "cell.json", values)
    text = (tmp_path / "cell.json").read_text()
    assert json.loads(text) == {"count": 3, "third": 1.0 / 3.0, "flag": True, "row": [1.5, 2.0]}
    assert text.endswith("}\n")
    assert '\n  "count": 3' in text


def test_what_is_no_json_value_is_named(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="PosixPath is no JSON value"):
        dump_json({"folder": tmp_path})
