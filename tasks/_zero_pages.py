"""Gives memory back to the system that a library has filled with zeros and may never use.

An idle PyBullet world takes 28 MB, of which 20 MB are buffers of zeros. On Linux, a page of zeros that is private to
the process can be dropped: whoever reads it later gets zeros again, whoever writes it gets a new page. So no number
changes, and no call becomes slower but the first ones that use such a page. Elsewhere nothing is done.

Only pages that are in memory are dropped. A page that was never written reads as zeros, too, but dropping it gains
nothing, and Python may take it for its own objects between the look and the drop, which would then lose them.

Memory is read through `/proc/self/mem`, not at its address: a region that was listed may be gone a moment later, for
instance the memory that held the list, and reading an address that is gone would end the process.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

import numpy as np

MAPS = Path("/proc/self/maps")
MEMORY = Path("/proc/self/mem")
LEAST_PAGES = 16
"""Shorter runs of zeros stay: each costs a call, and they are not the buffers that are meant (ours)."""
PAGES_AT_ONCE = 64
"""Pages that are copied to be looked at (ours)."""
WORD_BYTES = 8
Region = tuple[int, int]
"""First address, and the one after the last."""


@contextmanager
def zeros_given_back() -> Iterator[None]:
    """Give back the pages of zeros of all memory that the process is given inside of the `with` block.

    Only one thread may allocate memory meanwhile.
    """
    if not sys.platform.startswith("linux") or not hasattr(mmap, "MADV_DONTNEED"):
        yield
        return
    before = private_regions(MAPS.read_text())
    yield
    for region in private_regions(MAPS.read_text()):
        for new in without(region, before):
            give_back_zeros(new)


def private_regions(maps: str) -> list[Region]:
    """Return the regions of anonymous private memory, in order, from the text of `/proc/PID/maps`."""
    regions = []
    for line in maps.splitlines():
        addresses, permissions, _, _, _, *name = line.split(maxsplit=5)
        if permissions == "rw-p" and name in ([], ["[heap]"]):
            first, end = (int(address, 16) for address in addresses.split("-"))
            regions.append((first, end))
    return regions


def without(region: Region, others: list[Region]) -> Iterator[Region]:
    """Yield the parts of a region that are in none of the others, which are in order and do not overlap."""
    start, end = region
    for first, last in others:
        if first < end and last > start:
            if first > start:
                yield start, first
            start = max(start, last)
    if start < end:
        yield start, end


def give_back_zeros(region: Region) -> None:
    """Give back the runs of at least `LEAST_PAGES` pages of zeros in a region, which begins and ends with a page.

    Where a part of the region is gone, the pages around it may stay.
    """
    copy, _ = _scratch()
    start, end = region
    with suppress(OSError), MEMORY.open("rb", buffering=0) as memory:  # some systems let no process read its memory
        for first in range(start, end, len(copy)):
            with suppress(OSError):  # nothing is there any more
                resident = _resident(first, min(len(copy), end - first))
                size = os.preadv(memory.fileno(), [memoryview(copy)[: end - first]], first)
                content = np.frombuffer(memoryview(copy)[:size], dtype=np.uint64).reshape(
                    -1, mmap.PAGESIZE // WORD_BYTES
                )
                for run in _runs(resident[: len(content)] & ~content.any(axis=1)):
                    _drop_zeros(memory.fileno(), first + run.start * mmap.PAGESIZE, len(run) * mmap.PAGESIZE)


def _resident(address: int, size: int) -> np.ndarray:
    """Return which of the pages are in memory. Reading a page puts it there. Raises `OSError` if one is gone."""
    pages = np.zeros(size // mmap.PAGESIZE, dtype=np.uint8)
    if _library().mincore(address, size, pages.ctypes.data):
        raise OSError("no such memory")
    return (pages & 1).astype(bool)


def _runs(wanted: np.ndarray) -> Iterator[range]:
    """Yield the numbers of every run of at least `LEAST_PAGES` wanted pages."""
    numbers = np.flatnonzero(wanted)
    for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1):
        if len(run) >= LEAST_PAGES:
            yield range(int(run[0]), int(run[-1]) + 1)


def _drop_zeros(memory: int, address: int, size: int) -> None:
    """Drop pages that still hold nothing but zeros.

    They are looked at again, because other threads ran while NumPy looked at the copy. PyDLL calls the library without
    giving up Python's lock, so none of Python's runs in between.
    """
    library = _library()
    copy, zeros = _scratch()
    if library.pread(memory, copy, size, address) == size and library.memcmp(copy, zeros, size) == 0:
        # A refusal is no error: the pages then stay where they are.
        library.madvise(address, size, mmap.MADV_DONTNEED)


@cache
def _scratch() -> tuple[ctypes.Array[ctypes.c_char], ctypes.Array[ctypes.c_char]]:
    """Return room for a copy, and as many zeros.

    They are kept, and not taken from the heap: a world's buffers would come to lie where a copy has been, in memory
    that was there before. They are private, so that a forked process does not write into its parent's.
    """
    room = ctypes.c_char * (PAGES_AT_ONCE * mmap.PAGESIZE)
    private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    copy, zeros = (room.from_buffer(mmap.mmap(-1, ctypes.sizeof(room), flags=private)) for _ in range(2))
    return copy, zeros


@cache
def _library() -> ctypes.PyDLL:
    library = ctypes.PyDLL(None)
    library.pread.argtypes = (ctypes.c_int, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_long)
    library.pread.restype = ctypes.c_ssize_t
    library.memcmp.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
    library.mincore.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
    library.madvise.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    return library
