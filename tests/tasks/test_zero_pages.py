"""Pages of zeros are given back: less memory is resident, and every byte stays what it was."""

from __future__ import annotations

import ctypes
import mmap
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

zero_pages: Any = import_module("codesign_bench.tasks._zero_pages")

PAGE = mmap.PAGESIZE
MAPS = """\
00400000-00401000 r-xp 00000000 08:02 173521 /usr/bin/program
00e03000-00e24000 rw-p 00000000 00:00 0 [heap]
7f0000000000-7f0000010000 rw-p 00000000 00:00 0
7f0000020000-7f0000030000 rw-p 00000000 08:02 99 /usr/lib/a file.so
7f0000040000-7f0000050000 ---p 00000000 00:00 0
7f0000060000-7f0000070000 rw-s 00000000 00:00 0
7ffc00000000-7ffc00021000 rw-p 00000000 00:00 0 [stack]
"""


def test_only_private_memory_without_a_file_is_looked_at() -> None:
    assert zero_pages.private_regions(MAPS) == [(0xE03000, 0xE24000), (0x7F0000000000, 0x7F0000010000)]


@pytest.mark.parametrize(
    ("others", "left"),
    [
        ([], [(10, 20)]),
        ([(0, 10), (20, 30)], [(10, 20)]),
        ([(0, 12)], [(12, 20)]),
        ([(12, 14), (16, 25)], [(10, 12), (14, 16)]),
        ([(5, 25)], []),
        ([(10, 20)], []),
    ],
)
def test_memory_that_was_there_before_is_left_alone(others: list[tuple[int, int]], left: list[tuple[int, int]]) -> None:
    assert list(zero_pages.without((10, 20), others)) == left


def resident_kilobytes() -> int:
    """Return how much memory of this process is resident."""
    lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Rss:"))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="nothing is given back on other systems")
def test_zeros_are_given_back_and_everything_reads_as_before() -> None:
    pages = 4096
    with zero_pages.zeros_given_back():
        block = mmap.mmap(-1, pages * PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        array = np.frombuffer(block, dtype=np.uint8)
        array[:] = 0  # touches every page, so that all are resident
        array[1000 * PAGE + 5] = 7
        array[-1] = 9
        before = resident_kilobytes()
    freed = before - resident_kilobytes()
    assert freed > 0.9 * pages * PAGE / 1024
    assert array.sum() == 16
    assert (array[1000 * PAGE + 5], array[-1]) == (7, 9)
    array[2000 * PAGE] = 1
    assert array.sum() == 17


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="nothing is given back on other systems")
def test_short_runs_and_what_was_there_before_stay() -> None:
    block = mmap.mmap(-1, 256 * PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    array = np.frombuffer(block, dtype=np.uint8)
    array[:] = 0
    before = resident_kilobytes()
    with zero_pages.zeros_given_back():
        pass
    assert resident_kilobytes() > before - 128 * PAGE / 1024


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="nothing is given back on other systems")
def test_memory_that_is_gone_by_then_ends_no_process() -> None:
    library, pages = ctypes.CDLL(None), 4096
    library.mmap.restype = ctypes.c_void_p
    private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    start = library.mmap(None, ctypes.c_size_t(pages * PAGE), mmap.PROT_READ | mmap.PROT_WRITE, private, -1, 0)
    ctypes.memset(start, 0, pages * PAGE)  # touches every page, so that all are resident
    assert library.munmap(ctypes.c_void_p(start + 2000 * PAGE), ctypes.c_size_t(100 * PAGE)) == 0
    before = resident_kilobytes()
    zero_pages.give_back_zeros((start, start + pages * PAGE))
    assert before - resident_kilobytes() > 0.9 * pages * PAGE / 1024


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="nothing is given back on other systems")
def test_pages_that_were_never_written_are_not_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    # Python may be about to use them: a page that it fills between the look and the drop would be lost.
    dropped: list[tuple[int, int]] = []
    monkeypatch.setattr(zero_pages, "_drop_zeros", lambda memory, address, size: dropped.append((address, size)))
    block = mmap.mmap(-1, 256 * PAGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    array = np.frombuffer(block, dtype=np.uint8)
    array[64 * PAGE : 128 * PAGE] = 0
    start = array.ctypes.data
    zero_pages.give_back_zeros((start, start + 256 * PAGE))
    sizes = [size for address, size in dropped if start <= address < start + 256 * PAGE]
    assert sum(sizes) == 64 * PAGE


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="nothing is given back on other systems")
def test_a_forked_process_has_room_of_its_own_for_copies() -> None:
    # Of shared room, one process would judge its pages by what another has just copied.
    private = zero_pages.private_regions(zero_pages.MAPS.read_text())
    for room in zero_pages._scratch():
        start = ctypes.addressof(room)
        assert any(first <= start and start + len(room) <= end for first, end in private)


def test_other_systems_do_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(zero_pages, "private_regions", asked.append)
    with zero_pages.zeros_given_back():
        done = True
    assert done
    assert asked == []
