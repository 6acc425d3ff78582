"""Archives of results: one zip file with cells, tables and a manifest, which says what every byte must be.

`archive.json`, the manifest, has the schema, SHA-256 and size of every other file, and what the cells record of code,
packages and tuning. An archive may come from anybody. It is read as strictly as a results folder: only names that a
results folder has, only regular files of stated sizes, nothing outside of its own folder, nothing that is executed.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import BinaryIO

from codesign_bench.storage.files import json_bytes, reason_of, replacing
from codesign_bench.storage.layout import (
    ARCHIVE_FILE,
    CURVE_FILE,
    EVALUATION_FILE,
    MARKER_FILE,
    METRICS_FILE,
    POLICY_FILE,
)
from codesign_bench.storage.manifest import SCHEMA, Manifest, StoredFile
from codesign_bench.storage.measurements import ALL, BEST_KNOWN_PLANS
from codesign_bench.storage.reading import (
    JSON_BYTES,
    MEGABYTE,
    DamagedFile,
    NewerFile,
    UnreadableFile,
    open_regular,
    parse_json,
    read_bytes,
)
from codesign_bench.storage.records import CELL_FILE
from codesign_bench.storage.tables import TABLE_BYTES

SUFFIX = ".zip"
ARRAY_BYTES = 256 * MEGABYTE
"""As large as a file of arrays may be."""
ARCHIVE_BYTES, UNPACKED_BYTES = 1024 * MEGABYTE, 2048 * MEGABYTE
"""Largest archive, and most bytes of its files together; the reference results have 93 MB of files."""
MOST_FILES = 60_000
"""Fewer than an archive may list without the extension to 64 bits, which is refused."""
LISTING_BYTES = 16 * MEGABYTE
"""Largest list of files at the end of an archive."""
LONGEST_NAME = 500
"""Characters of a file's path."""
PIECE = 2**20
"""Bytes that are read at once."""

IN_A_CELL = {
    CELL_FILE: JSON_BYTES,
    CURVE_FILE: TABLE_BYTES,
    METRICS_FILE: TABLE_BYTES,
    EVALUATION_FILE: TABLE_BYTES,
    POLICY_FILE: ARRAY_BYTES,
}
"""File of a cell -> its largest size."""
BESIDE_CELLS = {
    MARKER_FILE: JSON_BYTES,
    "deployment/*/protocol*.json": JSON_BYTES,
    **{kind.pattern: TABLE_BYTES for kind in ALL},
    BEST_KNOWN_PLANS: ARRAY_BYTES,
}
"""Pattern of a file beside the cells -> its largest size."""
CELL_FOLDER = "*/*/*/seed-*"
PART = re.compile(r"[^\x00-\x1f\x7f\ud800-\udfff/\\:*?\"<>|]{1,255}")
"""A part of a path that every system can hold."""
END = struct.Struct("<4s4H2LH")
"""The last record of a zip file: signature, two numbers of disks, entries (twice), size and place of the list, ..."""
END_SIGNATURE, LOCATOR_64 = b"PK\x05\x06", b"PK\x06\x07"
LOCATOR_BYTES = 20
FIRST_DAY = (1980, 1, 1, 0, 0, 0)
"""Date of every file in an archive, so that the same results give the same bytes."""
FAULTS = (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, NotImplementedError, EOFError)
"""Exceptions of reading a damaged zip file or manifest; `zipfile` also raises these."""
DAMAGED_ZIP = (zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, struct.error, RuntimeError, *FAULTS)


def is_archive(folder: Path) -> bool:
    """Return whether a results folder is an unpacked archive, which is only read."""
    return os.path.exists(folder / ARCHIVE_FILE)


def limit_of(name: str) -> int | None:
    """Return the largest size of a file with this path in an archive, in bytes; None: no archive has such a file."""
    parts = name.split("/")
    if len(name) > LONGEST_NAME or not all(PART.fullmatch(part) and part.rstrip(". ") == part for part in parts):
        return None
    patterns = {f"{CELL_FOLDER}/{file}": limit for file, limit in IN_A_CELL.items()} | BESIDE_CELLS
    for pattern, limit in patterns.items():
        wanted = pattern.split("/")
        if len(wanted) == len(parts) and all(map(fnmatchcase, parts, wanted)):
            return limit
    return None


def files_in(folder: Path, cells: Iterable[str]) -> Iterator[str]:
    """Yield the paths of the files of a results folder that an archive takes: those of `cells`, and tables.

    Args:
        folder: a results folder.
        cells: the cells' folders, as paths below it.
    """
    for pattern in BESIDE_CELLS:
        found = sorted(folder.glob(pattern)) if "*" in pattern else [folder / pattern]
        yield from (path.relative_to(folder).as_posix() for path in found if path.is_file())
    for cell in cells:
        yield from (f"{cell}/{file}" for file in IN_A_CELL if (folder / cell / file).is_file())


def write_archive(path: Path, folder: Path, names: Iterable[str], manifest: Manifest) -> Manifest:
    """Write the files `names` below `folder` and the manifest to the archive `path`, and return the manifest.

    The archive is complete and checked before it gets its name.

    Args:
        path: a file that does not exist yet.
        folder: a results folder.
        names: paths below it, each of which an archive may have.
        manifest: without files.

    Raises:
        UnusableFile: a file cannot be read, or no archive can have it.
        OSError: the archive cannot be written.
    """
    files = {}
    with tempfile.TemporaryFile(dir=path.parent) as draft:
        with zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED, allowZip64=False) as archive:
            for name in names:
                limit = limit_of(name)
                if limit is None:
                    raise DamagedFile(folder / name, "an archive cannot have a file of this name")
                content = read_bytes(folder / name, limit)
                files[name] = StoredFile(len(content), hashlib.sha256(content).hexdigest())
                archive.writestr(_entry(name), content)
            manifest = replace(manifest, files=files)
            archive.writestr(_entry(ARCHIVE_FILE), json_bytes(manifest.to_json()))
        _check_end(path, draft)
        for _ in _contents(path, draft):
            pass
        draft.seek(0)
        with replacing(path) as stream:
            shutil.copyfileobj(draft, stream)
    return manifest


def read_manifest(path: Path) -> Manifest:
    """Return the manifest of an archive, or of a folder that one was unpacked to.

    Raises:
        FileNotFoundError: there is none.
        UnusableFile: it is not an archive, or its manifest is damaged.
    """
    if path.is_dir():
        return _parsed(path / ARCHIVE_FILE, read_bytes(path / ARCHIVE_FILE, JSON_BYTES))
    with _opened(path) as stream, _reading(path), zipfile.ZipFile(stream) as archive:
        return _manifest_in(path, archive)


def check_archive(path: Path) -> Manifest:
    """Return the manifest of an archive, or of a folder that one was unpacked to, after checking every file.

    Raises:
        FileNotFoundError: there is none.
        UnusableFile: names what is wrong.
    """
    manifest = read_manifest(path)
    if path.is_dir():
        for name, file in manifest.files.items():
            _check(path / name, file, read_bytes(path / name, _limit(path, name)))
        return manifest
    with _opened(path) as stream:
        for _ in _contents(path, stream):
            pass
    return manifest


def unpack(path: Path, folder: Path) -> None:
    """Write the files of an archive to a new folder, after checking their names, sizes and checksums.

    Raises:
        FileNotFoundError: there is no such archive.
        UnusableFile: it is not an archive, or damaged; the folder may have a part of its files.
        OSError: a file cannot be written.
    """
    folder.mkdir()
    with _opened(path) as stream:
        for name, content in _contents(path, stream):
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            with open(target, "xb") as written:
                written.write(content)


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    """Give a stream of the archive `path`, whose end says that its list of files can be read in bounded memory."""
    with os.fdopen(open_regular(path, ARCHIVE_BYTES), "rb") as stream:
        _check_end(path, stream)
        yield stream


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn what `zipfile` raises into one line.

    Raises:
        UnusableFile: names the archive and the reason.
    """
    try:
        yield
    except DAMAGED_ZIP as error:
        reason = f"no {error}" if isinstance(error, KeyError) else " ".join(str(error).split()) or type(error).__name__
        raise DamagedFile(path, reason) from error
    except OSError as error:
        raise UnreadableFile(path, reason_of(error)) from error


def _check_end(path: Path, stream: BinaryIO) -> None:
    """Check the last record of a zip file, before `zipfile` reads the list that it points to.

    Raises:
        DamagedFile: it is not as `write_archive` writes it, or its list is too long.
    """
    size = stream.seek(0, os.SEEK_END)
    before = min(size, END.size + LOCATOR_BYTES)
    stream.seek(size - before)
    tail = stream.read(before)
    if len(tail) < END.size or not tail[-END.size :].startswith(END_SIGNATURE):
        raise DamagedFile(path, "it is not an archive that codesign-bench pack wrote")
    _, _, _, _, count, listing, _, comment = END.unpack(tail[-END.size :])
    if comment or tail.startswith(LOCATOR_64) or count > MOST_FILES or listing > LISTING_BYTES:
        raise DamagedFile(path, f"it lists too many files; an archive has at most {MOST_FILES:,}")
    stream.seek(0)


def _contents(path: Path, stream: BinaryIO) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of every file of an archive, the manifest included, each after all of its checks.

    Raises:
        UnusableFile: names what is wrong.
    """
    with _reading(path), zipfile.ZipFile(stream) as archive:
        manifest = _manifest_in(path, archive)
        names = [entry.filename for entry in archive.infolist()]
        if len({name.casefold() for name in names}) != len(names):
            raise ValueError("two of its files have the same name")
        if other := {*names} ^ {*manifest.files, ARCHIVE_FILE}:
            raise ValueError(f"its manifest and its files differ: {min(other)[:LONGEST_NAME]}")
        for entry in archive.infolist():
            _check_kind(entry)
            if entry.filename == ARCHIVE_FILE:
                yield ARCHIVE_FILE, _read(archive, entry, JSON_BYTES)
                continue
            file = manifest.files[entry.filename]
            content = _read(archive, entry, file.size)
            _check(path / entry.filename, file, content)
            yield entry.filename, content


def _manifest_in(path: Path, archive: zipfile.ZipFile) -> Manifest:
    try:
        entry = archive.getinfo(ARCHIVE_FILE)
    except KeyError as error:
        raise ValueError(f"it has no {ARCHIVE_FILE}, so codesign-bench pack did not write it") from error
    _check_kind(entry)
    return _parsed(path, _read(archive, entry, JSON_BYTES))


def _parsed(path: Path, content: bytes) -> Manifest:
    """Return the manifest with this content.

    Raises:
        UnusableFile: it is none, names files that no archive has, or more bytes than are read.
    """
    with _reading(path):
        values = parse_json(content)
        schema = values["schema"]
        if type(schema) is int and schema > SCHEMA:
            raise NewerFile(path, f"schema {schema} is from a newer version; this version reads up to {SCHEMA}")
        manifest = Manifest.from_json(values)
    if len(manifest.files) > MOST_FILES or sum(file.size for file in manifest.files.values()) > UNPACKED_BYTES:
        raise DamagedFile(path, f"its files are larger than {UNPACKED_BYTES // MEGABYTE} MB")
    for name, file in manifest.files.items():
        if file.size > _limit(path, name):
            raise DamagedFile(path, f"{name} is larger than {_limit(path, name) // MEGABYTE} MB")
    return manifest


def _limit(path: Path, name: str) -> int:
    limit = limit_of(name)
    if limit is None:
        raise DamagedFile(path, f"results have no file called {name[:LONGEST_NAME]!r}")
    return limit


def _check_kind(entry: zipfile.ZipInfo) -> None:
    """Check that an entry is a plain file.

    Raises:
        ValueError: it is a folder, a link or encrypted, or compressed otherwise than by `pack`.
    """
    mode = entry.external_attr >> 16
    if entry.is_dir() or (stat.S_IFMT(mode) and not stat.S_ISREG(mode)):
        raise ValueError(f"{entry.filename[:LONGEST_NAME]} is not a regular file")
    if entry.flag_bits & 1 or entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{entry.filename[:LONGEST_NAME]} is encrypted, or compressed in another way")


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, limit: int) -> bytes:
    """Return the content of an entry of at most `limit` bytes, whatever it says of its own size.

    Raises:
        ValueError: there is more.
    """
    pieces, size = [], 0
    with archive.open(entry) as stream:
        while piece := stream.read(PIECE):
            size += len(piece)
            if size > limit:
                raise ValueError(f"{entry.filename[:LONGEST_NAME]} has more than {limit} bytes")
            pieces.append(piece)
    return b"".join(pieces)


def _check(path: Path, file: StoredFile, content: bytes) -> None:
    """Check the content of a file.

    Raises:
        DamagedFile: it is not what the manifest says.
    """
    if len(content) != file.size or hashlib.sha256(content).hexdigest() != file.sha256:
        raise DamagedFile(path, "its checksum does not match")


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, FIRST_DAY)
    entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
    entry.external_attr = (stat.S_IFREG | 0o644) << 16
    return entry
