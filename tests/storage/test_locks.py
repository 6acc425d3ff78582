"""A running cell holds a lock, also where the file system has none."""

from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
from pathlib import Path

import filelock
import pytest

from codesign_bench.storage.locks import HOLDER_FILE, LOCK_FILE, has_locks, is_locked, locked


def refuse(number: int) -> object:
    """Return a `flock` that answers with this error."""

    def flock(descriptor: int, operation: int) -> None:
        raise OSError(number, os.strerror(number))

    return flock


@pytest.fixture(params=["locks", "no locks"])
def folder(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder on a file system with locks, and on one without."""
    if request.param == "no locks":
        monkeypatch.setattr("fcntl.flock", refuse(errno.ENOLCK))
    return tmp_path


def test_a_lock_is_seen_while_it_is_held(folder: Path) -> None:
    assert not is_locked(folder)
    with locked(folder):
        assert is_locked(folder)
        with pytest.raises(filelock.Timeout), locked(folder):
            pass
    assert not is_locked(folder)


def test_a_lock_ends_with_its_process(folder: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    (folder / LOCK_FILE).write_text("")
    (folder / HOLDER_FILE).write_text(f"{dead.pid}\n{socket.gethostname()}\n")
    assert not is_locked(folder)
    with locked(folder):
        assert is_locked(folder)


def test_a_file_system_says_whether_it_has_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert has_locks(tmp_path)
    for number in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
        monkeypatch.setattr("fcntl.flock", refuse(number))
        assert not has_locks(tmp_path)
    monkeypatch.setattr("fcntl.flock", refuse(errno.EIO))
    assert has_locks(tmp_path)
    assert not list(tmp_path.iterdir())


def test_without_locks_the_holder_on_another_host_is_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fcntl.flock", refuse(errno.ENOLCK))
    (tmp_path / HOLDER_FILE).write_text("1\nanother-host\n")
    assert is_locked(tmp_path)


def test_another_error_of_the_system_is_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fcntl.flock", refuse(errno.EIO))
    with pytest.raises(OSError, match="Input/output error"), locked(tmp_path):
        pass
    assert not is_locked(tmp_path)


def test_nothing_runs_where_no_folder_is(tmp_path: Path) -> None:
    assert not is_locked(tmp_path / "nowhere")
    (tmp_path / "file").write_text("")
    assert not is_locked(tmp_path / "file")
