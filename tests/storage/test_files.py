"""A file is written whole or not at all, whatever happens in between."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.storage.files import (
    Outputs,
    dump_json,
    make_folder,
    remove_partial_files,
    replacing,
    write_bytes,
    write_json,
    write_output,
)

BEYOND_A_LIMIT = """
import resource, sys
from pathlib import Path
from codesign_bench.errors import UserError
from codesign_bench.storage.files import Outputs
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
folder = Path(sys.argv[1])
try:
    with Outputs("--out") as outputs:
        outputs.write(folder / "a.csv", b"new")
        outputs.write(folder / "b.png", bytes(2000))
except UserError as error:
    print(error)
"""
"""Writes two files in a process that may write no more than 1,000 bytes into one, as on a full disk."""


def partial(folder: Path) -> list[Path]:
    """Return the files that are not complete."""
    return [path for path in folder.rglob("*") if path.name.endswith(".partial")]


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


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o002, 0o664), (0o077, 0o600)])
def test_a_file_has_the_permissions_that_the_umask_leaves(tmp_path: Path, mask: int, mode: int) -> None:
    before = os.umask(mask)
    try:
        write_bytes(tmp_path / "curve.csv", b"")
        write_output("--out", tmp_path / "figure.png", b"")
    finally:
        os.umask(before)
    assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {mode}


def test_a_long_name_leaves_room_for_that_of_the_partial_file(tmp_path: Path) -> None:
    write_bytes(tmp_path / ("x" * 255), b"content")
    assert (tmp_path / ("x" * 255)).read_bytes() == b"content"


def test_files_that_belong_together_appear_together(tmp_path: Path) -> None:
    write_bytes(tmp_path / "a.csv", b"old")
    with Outputs("--out") as outputs:
        outputs.write(tmp_path / "a.csv", b"new")
        outputs.write(tmp_path / "below" / "b.png", "text")
        assert (tmp_path / "a.csv").read_bytes() == b"old"
        assert not (tmp_path / "below" / "b.png").exists()
    assert (tmp_path / "a.csv").read_bytes() == b"new"
    assert (tmp_path / "below" / "b.png").read_bytes() == b"text"
    assert partial(tmp_path) == []


def test_after_an_error_none_of_them_appears(tmp_path: Path) -> None:
    write_bytes(tmp_path / "a.csv", b"old")

    def fail_half_way() -> None:
        with Outputs("--out") as outputs:
            outputs.write(tmp_path / "a.csv", b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert (tmp_path / "a.csv").read_bytes() == b"old"
    assert partial(tmp_path) == []


def test_a_folder_in_the_place_of_a_file_is_found_before_anything_is_replaced(tmp_path: Path) -> None:
    write_bytes(tmp_path / "a.csv", b"old")
    (tmp_path / "b.csv").mkdir()

    def write_both() -> None:
        with Outputs("--out here") as outputs:
            outputs.write(tmp_path / "a.csv", b"new")
            outputs.write(tmp_path / "b.csv", b"new")

    with pytest.raises(UserError, match=r"--out here: b\.csv is not writable \(it is a folder\)"):
        write_both()
    assert (tmp_path / "a.csv").read_bytes() == b"old"


def test_the_systems_reason_is_in_the_line_and_the_earlier_files_survive(tmp_path: Path) -> None:
    for name in ("a.csv", "b.png"):
        write_bytes(tmp_path / name, b"old")
    done = subprocess.run([sys.executable, "-c", BEYOND_A_LIMIT, tmp_path], capture_output=True, text=True)
    assert done.stdout == "--out: b.png is not writable (File too large)\n", done.stderr
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.csv": b"old", "b.png": b"old"}


def test_a_folder_is_made_and_left_empty_or_refused(tmp_path: Path) -> None:
    make_folder("--out", tmp_path / "new" / "figures")
    assert list((tmp_path / "new" / "figures").iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"--out: not writable \(Not a directory\)"):
        make_folder("--out", tmp_path / "file" / "figures")


def test_bytes_of_a_path_that_are_no_text_can_be_written(tmp_path: Path) -> None:
    write_output("--out", tmp_path / "page.md", os.fsdecode(b"runs-\xff"))
    assert (tmp_path / "page.md").read_text() == "runs-\\udcff"


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
    with pytest.raises(TypeError, match="PosixPath is not a JSON value"):
        dump_json({"folder": tmp_path})
