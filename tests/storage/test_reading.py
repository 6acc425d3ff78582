"""Files are opened without waiting, and what stands in their place is told apart: damaged, or not readable."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from codesign_bench.storage.reading import DamagedFile, UnreadableFile, parse_json, read_bytes, read_json
from codesign_bench.storage.records import CellRecord

NOBODY = 65534


@contextmanager
def as_nobody() -> Iterator[None]:
    """Give up the rights of root for a while, to whom every file is open."""
    own = os.geteuid()
    if own == 0:
        os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(own)


def test_a_regular_file_is_read_and_a_missing_one_is_missing(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"content")
    assert read_bytes(tmp_path / "a", 7) == b"content"
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "b", 7)


def test_a_link_to_a_file_is_followed(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"content")
    (tmp_path / "b").symlink_to("a")
    assert read_bytes(tmp_path / "b", 7) == b"content"


def test_what_is_no_file_is_named_and_never_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "zeros").symlink_to("/dev/zero")
    for name, reason in (("pipe", "not a regular file"), ("folder", "a folder"), ("zeros", "not a regular file")):
        with pytest.raises(DamagedFile, match=f"{name}.*{reason}") as caught:
            read_bytes(tmp_path / name, 10)
        assert "delete" not in str(caught.value)


def test_a_file_beyond_its_limit_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "large").open("wb") as stream:
        stream.truncate(2**40)
    with pytest.raises(DamagedFile, match="larger than 8 MB"):
        read_json(tmp_path / "large")


def test_what_the_system_does_not_let_us_read_is_not_called_damaged(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "nothing").symlink_to("nowhere")
    (tmp_path / "file").write_text("")
    for path, reason in (
        (tmp_path / "loop", "Too many levels of symbolic links"),
        (tmp_path / "nothing", "a link to nothing"),
        (tmp_path / "file" / "inside", "Not a directory"),
        (tmp_path / ("x" * 300), "File name too long"),
    ):
        with pytest.raises(UnreadableFile, match=reason) as caught:
            read_bytes(path, 10)
        assert "delete" not in str(caught.value)


def test_a_file_without_permission_says_so_and_nothing_of_deleting(tmp_path: Path) -> None:
    (tmp_path / "cell.json").write_text("")
    (tmp_path / "cell.json").chmod(0)
    with as_nobody(), pytest.raises(UnreadableFile, match="Permission denied") as caught:
        CellRecord.read(tmp_path)
    assert "delete" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "Expecting value"),
        (b"{", "Expecting property name"),
        (b"\xff{}", "not UTF-8 at byte 0"),
        (b"\xef\xbb\xbf{}", "BOM"),
        (b'{"a": 1, "a": 2}', "the key 'a' is there twice"),
        (b"[" * 100_000 + b"]" * 100_000, "nested too deeply"),
        (b"9" * 5000, "a number of 5000 digits"),
        (b'{"a": "\0"}', "control character"),
    ],
)
def test_what_is_no_json_of_ours_is_damaged(tmp_path: Path, content: bytes, reason: str) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(DamagedFile, match=reason):
        read_json(tmp_path / "a.json")


def test_values_are_read_as_they_were_written() -> None:
    assert parse_json('{"a": [1, 2.5, null, "\u00e4"], "b": {}}') == {"a": [1, 2.5, None, "ä"], "b": {}}
