"""Gives memory back to the system that a library has filled with zeros and may never use.

An idle PyBullet world takes 28 MB, of which 20 MB are buffers of zeros. On Linux, a page of zeros that is private to
the process can be dropped: whoever reads it later gets zeros again, whoever writes it gets a new page. So no number
changes, and no call becomes slower but the first ones that use such a page. Elsewhere nothing is done.
"""

from __future__ import annotations

import ctypes
import mmap
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

MAPS = Path("/proc/self/maps")
LEAST_PAGES = 16
"""Shorter runs of zeros stay: each costs a call, and they are not the buffers that are meant (ours)."""
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
    """Give back the runs of at least `LEAST_PAGES` pages of zeros in a region, which begins and ends with a page."""
    # The library is called without giving up Python's lock, so no thread of Python writes into a page in between.
    madvise = ctypes.PyDLL(None).madvise
    madvise.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    start, end = region
    memory = np.frombuffer(memoryview((ctypes.c_char * (end - start)).from_address(start)), dtype=np.uint64)
    zero = np.flatnonzero(~memory.reshape(-1, mmap.PAGESIZE // WORD_BYTES).any(axis=1))
    for run in np.split(zero, np.flatnonzero(np.diff(zero) > 1) + 1):
        if len(run) >= LEAST_PAGES:
            # A refusal is no error: the pages then stay where they are.
            madvise(start + int(run[0]) * mmap.PAGESIZE, len(run) * mmap.PAGESIZE, mmap.MADV_DONTNEED)
