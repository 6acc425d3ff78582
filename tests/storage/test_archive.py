"""Archives: what is packed comes back byte for byte; whatever else a zip file may hold is refused."""

from __future__ import annotations

import hashlib
import io
import json
import stat
import struct
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from builders import rising, store_cell
from codesign_bench.errors import UserError
from codesign_bench.storage.archive import (
    ARCHIVE_FILE,
    IN_A_CELL,
    MOST_FILES,
    check_archive,
    files_in,
    is_archive,
    limit_of,
    read_manifest,
    unpack,
    write_archive,
)
from codesign_bench.storage.layout import open_folder
from codesign_bench.storage.manifest import Manifest, StoredFile
from codesign_bench.storage.reading import UnusableFile

CELL = "push/gnn_ppo/default/seed-00"
CURVE = f"{CELL}/curve.csv"


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Return a results folder with one finished cell and files that no archive takes."""
    folder = tmp_path / "runs"
    store_cell(folder, curve=rising(0.0, 1.0))
    (folder / CELL / "output.log").write_text("private")
    (folder / "notes.txt").write_text("private")
    return folder


@pytest.fixture
def archive(runs: Path, tmp_path: Path) -> Path:
    """Return an archive of the folder."""
    write_archive(tmp_path / "mine.zip", runs, files_in(runs, [CELL]), Manifest(title="mine"))
    return tmp_path / "mine.zip"


def contents(path: Path) -> dict[str, bytes]:
    """Return the files in a zip file."""
    with zipfile.ZipFile(path) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def manifest_with(files: Mapping[str, bytes], **changes: Any) -> bytes:
    """Return the content of a manifest of these files."""
    listed = {name: StoredFile(len(data), hashlib.sha256(data).hexdigest()) for name, data in files.items()}
    return json.dumps({**Manifest(files=listed).to_json(), **changes}).encode()


def test_what_is_packed_comes_back_byte_for_byte(runs: Path, archive: Path, tmp_path: Path) -> None:
    unpack(archive, tmp_path / "back")
    back = {path.relative_to(tmp_path / "back").as_posix() for path in (tmp_path / "back").rglob("*") if path.is_file()}
    assert back == {ARCHIVE_FILE, *(f"{CELL}/{name}" for name in ("cell.json", "curve.csv", "evaluation.csv"))}
    for name in back - {ARCHIVE_FILE}:
        assert (tmp_path / "back" / name).read_bytes() == (runs / name).read_bytes()
    assert check_archive(archive) == check_archive(tmp_path / "back") == read_manifest(archive)
    assert read_manifest(archive).title == "mine"


def test_the_same_results_give_the_same_bytes(runs: Path, archive: Path, tmp_path: Path) -> None:
    write_archive(tmp_path / "again.zip", runs, files_in(runs, [CELL]), Manifest(title="mine"))
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_an_unpacked_archive_is_only_read(archive: Path, tmp_path: Path) -> None:
    unpack(archive, tmp_path / "back")
    assert is_archive(tmp_path / "back")
    with pytest.raises(UserError, match="only read"):
        open_folder(tmp_path / "back")


@pytest.mark.parametrize(
    "name",
    [
        *("", "/", "cell.json", "notes.txt", "archive.json", f"/{CURVE}", f"../{CURVE}", f"{CELL}/../curve.csv"),
        *("push/../../seed-00/curve.csv", "push//default/seed-00/curve.csv", f"{CELL}/other.csv", "a/b/c/d/curve.csv"),
        *(
            "C:/b/c/seed-00/curve.csv",
            "a\\b/b/c/seed-00/curve.csv",
            "a/b/c/seed-\x00/curve.csv",
            "a/b/c/seed-0./cell.json",
        ),
        *("a/b/c/seed-\ud800/curve.csv", f"{'x' * 600}/b/c/seed-00/curve.csv", "design_sensitivity/../x.csv"),
        *("design_sensitivity/push.py", "deployment/push/x.csv", f"{CELL}/checkpoint.safetensors"),
    ],
)
def test_other_paths_than_those_of_results_are_no_files_of_an_archive(name: str) -> None:
    assert limit_of(name) is None


def test_files_of_results_have_limits() -> None:
    assert {name: limit_of(f"{CELL}/{name}") for name in IN_A_CELL} == IN_A_CELL
    for name in ("codesign-bench.json", "reference_points.csv", "design_sensitivity/push.csv", "best_known/push.csv"):
        assert limit_of(name)


def rewritten(path: Path, files: Mapping[str, bytes], entry: Callable[[str], zipfile.ZipInfo | str] = str) -> Path:
    """Write other files into the zip file `path`."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, data in files.items():
            opened.writestr(entry(name), data)
    return path


def link(name: str) -> zipfile.ZipInfo:
    """Return the entry of a symbolic link."""
    entry = zipfile.ZipInfo(name)
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    return entry


def changed(path: Path) -> None:
    files = contents(path)
    rewritten(path, {**files, CURVE: files[CURVE].replace(b"1.0", b"9.0")})


def longer(path: Path) -> None:
    files = contents(path)
    rewritten(path, {**files, CURVE: files[CURVE] + b"0" * 5_000_000})


def added(path: Path) -> None:
    rewritten(path, {**contents(path), "push/gnn_ppo/default/seed-01/curve.csv": b""})


def missing(path: Path) -> None:
    rewritten(path, {name: data for name, data in contents(path).items() if name != CURVE})


def outside(path: Path) -> None:
    files = {"../../escaped.csv": b"x"}
    rewritten(path, {**files, ARCHIVE_FILE: manifest_with(files)})


def absolute(path: Path) -> None:
    files = {(path.parent / "escaped.csv").resolve().as_posix(): b"x"}
    rewritten(path, {**files, ARCHIVE_FILE: manifest_with(files)})


def links(path: Path) -> None:
    files = {CURVE: b"/etc/passwd"}
    rewritten(path, {CURVE: b"/etc/passwd", ARCHIVE_FILE: manifest_with(files)}, link)


def twice(path: Path) -> None:
    files = contents(path)
    with zipfile.ZipFile(path, "a") as opened, pytest.warns(UserWarning, match="Duplicate"):
        opened.writestr(CURVE, files[CURVE])


def by_case(path: Path) -> None:
    files = {name: data for name, data in contents(path).items() if name != ARCHIVE_FILE}
    files["PUSH/gnn_ppo/default/seed-00/curve.csv"] = files[CURVE]
    rewritten(path, {**files, ARCHIVE_FILE: manifest_with(files)})


def without_manifest(path: Path) -> None:
    rewritten(path, {name: data for name, data in contents(path).items() if name != ARCHIVE_FILE})


def damaged_manifest(path: Path) -> None:
    rewritten(path, {**contents(path), ARCHIVE_FILE: b"{"})


def other_manifest(path: Path) -> None:
    rewritten(path, {**contents(path), ARCHIVE_FILE: b'{"schema": 1, "content": "else", "files": {}}'})


def newer(path: Path) -> None:
    files = {name: data for name, data in contents(path).items() if name != ARCHIVE_FILE}
    rewritten(path, {**files, ARCHIVE_FILE: manifest_with(files, schema=2)})


def too_large_in_words(path: Path) -> None:
    listed = {CURVE: StoredFile(2**40, "0")}
    rewritten(path, {CURVE: b"", ARCHIVE_FILE: json.dumps(replace(Manifest(), files=listed).to_json()).encode()})


def other_compression(path: Path) -> None:
    files = contents(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as opened:
        for name, data in files.items():
            opened.writestr(name, data)


def comment(path: Path) -> None:
    with zipfile.ZipFile(path, "a") as opened:
        opened.comment = b"x"


def many_entries(path: Path) -> None:
    data = path.read_bytes()
    count = struct.pack("<H", MOST_FILES + 1)
    path.write_bytes(data[:-14] + count + count + data[-10:])


def cut_off(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def no_zip(path: Path) -> None:
    path.write_bytes(b"PK" * 500)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def a_device(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


DAMAGES = (
    *(changed, longer, added, missing, outside, absolute, links, twice, by_case, without_manifest, damaged_manifest),
    *(other_manifest, newer, too_large_in_words, other_compression, comment, many_entries, cut_off, no_zip, empty),
    a_device,
)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda found: found.__name__)
def test_what_pack_did_not_write_is_refused_in_a_line(
    archive: Path, tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    damage(archive)
    with pytest.raises(UnusableFile) as refused:
        unpack(archive, tmp_path / "back")
    assert "mine.zip" in str(refused.value)
    assert "\n" not in str(refused.value)
    with pytest.raises(UnusableFile):
        check_archive(archive)
    assert not list(tmp_path.rglob("escaped.csv"))


def test_a_file_that_says_it_is_smaller_than_it_is_fills_no_memory(archive: Path, tmp_path: Path) -> None:
    files = contents(archive)
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, data in files.items():
            opened.writestr(name, b"\0" * 50_000_000 if name == CURVE else data)
    archive.write_bytes(bomb.getvalue())
    with pytest.raises(UnusableFile, match="more than"):
        unpack(archive, tmp_path / "back")


def test_a_file_changed_after_unpacking_is_found(archive: Path, tmp_path: Path) -> None:
    unpack(archive, tmp_path / "back")
    (tmp_path / "back" / CURVE).write_text("env_steps\n")
    with pytest.raises(UnusableFile, match="checksum"):
        check_archive(tmp_path / "back")


def test_an_archive_that_is_not_complete_never_gets_its_name(runs: Path, tmp_path: Path) -> None:
    with pytest.raises(UnusableFile, match="notes"):
        write_archive(tmp_path / "mine.zip", runs, [CURVE, "notes.txt"], Manifest())
    assert [path.name for path in tmp_path.iterdir()] == ["runs"]
