"""A checkpoint gives back what was saved, bit for bit, or says that it cannot."""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.method import State
from codesign_bench.seeding import Streams
from codesign_bench.storage.checkpoint import (
    Checkpoint,
    Progress,
    check_checkpoint,
    load_checkpoint,
    remove_checkpoint,
    save_checkpoint,
)

READERS = pytest.mark.parametrize("read", [load_checkpoint, check_checkpoint])
Read = Callable[[Path], Any]
MEGABYTE = 2**20


def numbered(number: int, size: int = 1_000) -> Checkpoint:
    """Return a checkpoint whose every part, large ones included, holds `number`."""
    large = {"replay.reward": np.full(size, number, np.float32), "replay.count": np.array(number)}
    return Checkpoint(State({"small": np.array([number])}, {"number": number}, large), {}, Progress(env_steps=number))


def number_of(path: Path) -> int:
    """Return the number that all parts of the checkpoint in `path` hold."""
    loaded = load_checkpoint(path)
    assert loaded is not None
    state, number = loaded.state, loaded.progress.env_steps
    assert state.values == {"number": number}
    for array in (*state.arrays.values(), *state.large.values()):
        assert (array == number).all()
    assert state.large.keys() == numbered(0).state.large.keys()
    return number


def example() -> Checkpoint:
    streams = Streams(3)
    streams["search"].normal(size=5)
    arrays = {
        "matrix": np.arange(6, dtype=np.float32).reshape(2, 3).T,
        "scalar": np.array(0.1),
        "flags": np.array([True, False]),
        "empty": np.zeros((0, 4)),
    }
    progress = Progress(env_steps=12, next_mark=2, curve=[{"env_steps": 0, "return_mean": 1.0 / 3.0}], wall_s=1.5)
    return Checkpoint(State(arrays, {"best": np.float64(-np.inf), "names": ["a"]}), streams.state(), progress)


def test_arrays_values_and_progress_survive(tmp_path: Path) -> None:
    saved = example()
    save_checkpoint(tmp_path / "checkpoint", saved)
    loaded = load_checkpoint(tmp_path / "checkpoint")
    assert loaded is not None
    assert loaded.progress == saved.progress
    assert loaded.state.values == {"best": -np.inf, "names": ["a"]}
    for name, array in saved.state.arrays.items():
        np.testing.assert_array_equal(loaded.state.arrays[name], array)
        assert loaded.state.arrays[name].dtype == array.dtype
        assert loaded.state.arrays[name].shape == array.shape


def test_random_streams_go_on_where_they_stood(tmp_path: Path) -> None:
    streams = Streams(3)
    streams["search"].normal(size=5)
    save_checkpoint(tmp_path / "checkpoint", Checkpoint(State({}, {}), streams.state(), Progress()))
    expected = streams["search"].normal(size=4)
    loaded, resumed = load_checkpoint(tmp_path / "checkpoint"), Streams(3)
    assert loaded is not None
    resumed.load_state(loaded.streams)
    np.testing.assert_array_equal(resumed["search"].normal(size=4), expected)


def test_no_checkpoint_is_none_of_any_steps(tmp_path: Path) -> None:
    assert load_checkpoint(tmp_path / "checkpoint") is None
    assert check_checkpoint(tmp_path / "checkpoint") == 0


@READERS
@pytest.mark.parametrize("kept", [0, 5, 100, -1])
def test_a_truncated_checkpoint_is_named_in_two_lines_at_most(tmp_path: Path, kept: int, read: Read) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, example())
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(UserError, match=r"checkpoint.*delete it") as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert str(caught.value).count("\n") <= 1


def flip(path: Path, place: int) -> None:
    """Flip the lowest bit of the byte at `place` of a file."""
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(bytes(content))


@READERS
def test_a_flipped_bit_is_noticed(tmp_path: Path, read: Read) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, example())
    flip(path, -1)
    with pytest.raises(UserError, match="checksum"):
        read(path)


def test_an_interrupted_save_leaves_the_old_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, example())
    before = path.read_bytes()

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", killed)
    with pytest.raises(KeyboardInterrupt):
        save_checkpoint(path, Checkpoint(State({}, {}), {}, Progress()))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def large_file(path: Path) -> Path:
    """Return the only large file beside a checkpoint."""
    (found,) = path.parent.glob("*.npz")
    return found


def test_large_arrays_survive_in_a_file_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.safetensors"
    large = {
        "replay.observation": np.arange(12, dtype=np.float32).reshape(3, 4).T,
        "replay.terminated": np.array([True, False]),
        "count": np.array(7),
        "empty": np.zeros((0, 3)),
        "every second": np.arange(10)[::2],
    }
    save_checkpoint(path, Checkpoint(State({}, {}, large), {}, Progress()))
    assert large_file(path).stat().st_size > path.stat().st_size
    check_checkpoint(path)
    loaded = load_checkpoint(path)
    assert loaded is not None
    assert loaded.state.large.keys() == large.keys()
    for name, array in large.items():
        np.testing.assert_array_equal(loaded.state.large[name], array)
        assert loaded.state.large[name].dtype == array.dtype


def test_only_the_large_file_that_belongs_to_the_checkpoint_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.safetensors"
    for number in range(3):
        save_checkpoint(path, numbered(number))
        assert number_of(path) == number
        assert sorted(tmp_path.iterdir()) == sorted([path, large_file(path)])
    save_checkpoint(path, example())
    assert list(tmp_path.iterdir()) == [path]
    save_checkpoint(path, numbered(4))
    remove_checkpoint(path)
    assert list(tmp_path.iterdir()) == []


@READERS
def test_a_missing_large_file_is_named(tmp_path: Path, read: Read) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, numbered(1))
    large = large_file(path)
    large.unlink()
    with pytest.raises(UserError, match=rf"checkpoint .*{large.name}.*delete it"):
        read(path)


@READERS
@pytest.mark.parametrize("kept", [0, 5, 100, -1])
def test_a_truncated_large_file_is_noticed(tmp_path: Path, kept: int, read: Read) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, numbered(1))
    large = large_file(path)
    large.write_bytes(large.read_bytes()[:kept])
    with pytest.raises(UserError, match=r"large-1\.npz is damaged"):
        read(path)


def test_another_checkpoints_large_file_is_refused(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / str(number)).mkdir()
        save_checkpoint(tmp_path / str(number) / "checkpoint", numbered(number))
    first, second = tmp_path / "1", tmp_path / "2"
    large_file(first / "checkpoint").replace(large_file(second / "checkpoint"))
    for read in (load_checkpoint, check_checkpoint):
        with pytest.raises(UserError, match="its checksums are not those of the checkpoint"):
            read(second / "checkpoint")


def test_no_flipped_bit_of_a_large_file_changes_a_number_unnoticed(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, numbered(1, size=20))
    large = large_file(path)
    whole, noticed = large.read_bytes(), 0
    for place in range(len(whole)):
        flip(large, place)
        try:
            assert number_of(path) == 1, "what is not noticed is not part of a number"
        except UserError:
            noticed += 1
        large.write_bytes(whole)
    assert noticed > 2 * 20 * 4


def test_a_large_file_is_written_and_checked_in_pieces(tmp_path: Path) -> None:
    path, size = tmp_path / "checkpoint", 128 * MEGABYTE
    checkpoint = numbered(1, size // 4)
    tracemalloc.start()
    save_checkpoint(path, checkpoint)
    written = tracemalloc.get_traced_memory()[1]
    tracemalloc.reset_peak()
    check_checkpoint(path)
    checked = tracemalloc.get_traced_memory()[1]
    tracemalloc.reset_peak()
    load_checkpoint(path)
    loaded = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert written < size / 2
    assert checked < size / 16
    assert loaded < 1.1 * size


@pytest.mark.parametrize("call", ["os.replace", "os.fsync", "os.chmod", "pathlib.Path.unlink"])
@pytest.mark.parametrize("spared", [0, 1])
def test_whatever_fails_a_whole_pair_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, spared: int
) -> None:
    path, calls = tmp_path / "checkpoint", 0
    save_checkpoint(path, numbered(1))

    def failing(*_: object, **__: object) -> None:
        nonlocal calls
        calls += 1
        if calls > spared:
            raise OSError(28, "No space left on device")
        original(*_, **__)

    with monkeypatch.context() as patched:
        owner, _, name = call.rpartition(".")
        original = getattr(sys.modules["os"] if owner == "os" else Path, name)
        patched.setattr(call, failing)
        try:
            save_checkpoint(path, numbered(2))
        except OSError:
            assert calls > spared
    assert number_of(path) in (1, 2)
    save_checkpoint(path, numbered(3))
    assert number_of(path) == 3
    assert len(list(tmp_path.glob("*"))) == 2


KILLED = """
import os, signal, sys
from pathlib import Path
from test_checkpoint import numbered, number_of, save_checkpoint

def killed_at(operation, path):
    process = os.fork()
    if process:
        return os.WIFSIGNALED(os.waitpid(process, 0)[1])
    left = operation

    def count(event, arguments):
        nonlocal left
        if event == "open" or (event.startswith(("os.", "tempfile.")) and event != "os.kill"):
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(count)
    save_checkpoint(path, numbered(2))
    os._exit(0)

found, operation = [], 0
while True:
    path = Path(sys.argv[1]) / str(operation) / "checkpoint"
    path.parent.mkdir()
    save_checkpoint(path, numbered(1))
    if not killed_at(operation, path):
        break
    found.append(number_of(path))
    save_checkpoint(path, numbered(3))
    assert number_of(path) == 3
    assert len(list(path.parent.glob("[a-z]*"))) == 2, "what the killed process left is gone"
    operation += 1
print(*found)
"""


def test_killed_at_any_file_operation_a_whole_pair_is_left(tmp_path: Path) -> None:
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = done.stdout.split()
    assert len(found) > 8
    assert found == sorted(found), "the old pair until some moment, the new one from then on"
    assert set(found) == {"1", "2"}
