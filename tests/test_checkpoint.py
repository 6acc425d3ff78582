"""A checkpoint gives back what was saved, bit for bit, or says that it cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codesign_bench.errors import UserError
from codesign_bench.method import State
from codesign_bench.seeding import Streams
from codesign_bench.storage.checkpoint import Checkpoint, Progress, load_checkpoint, save_checkpoint


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


def test_no_checkpoint_is_none(tmp_path: Path) -> None:
    assert load_checkpoint(tmp_path / "checkpoint") is None


@pytest.mark.parametrize("kept", [0, 5, 100, -1])
def test_a_truncated_checkpoint_is_named_in_two_lines_at_most(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, example())
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(UserError, match=r"checkpoint.*delete it") as caught:
        load_checkpoint(path)
    assert str(path) in str(caught.value)
    assert str(caught.value).count("\n") <= 1


def test_a_flipped_bit_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint"
    save_checkpoint(path, example())
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(bytes(content))
    with pytest.raises(UserError, match="checksum"):
        load_checkpoint(path)


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
