"""Processes that share work, each with a resource of its own that is made once.

The caller cuts the work into parts. Their number must not depend on that of the processes: then results do not either.
"""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any, Generic, TypeVar

from codesign_bench.processes import end_with, pin_threads

Resource = TypeVar("Resource")
Part = TypeVar("Part")
Result = TypeVar("Result")

CHUNKS_PER_WORKER = 4
"""With fewer, a worker may wait long for the last."""

_resource: Any = None
"""The resource of a worker process."""


class Workers(Generic[Resource]):
    """Worker processes, started on first use; they end with this process.

    Everything that they get and return is sent by pickle.
    """

    def __init__(self, make: Callable[[], Resource], count: int) -> None:
        self.count = count
        self._pool = ProcessPoolExecutor(
            count,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_prepare,
            initargs=(make, os.getpid()),
        )

    def map(self, work: Callable[[Resource, Part], Result], parts: Sequence[Part]) -> list[Result]:
        """Return what `work` returns for a worker's resource and every one of `parts`, in their order."""
        # What parts have in common, a policy for instance, is sent once for all parts that are sent together.
        together = max(1, len(parts) // (CHUNKS_PER_WORKER * self.count))
        return list(self._pool.map(partial(_run, work), parts, chunksize=together))


def _prepare(make: Callable[[], Any], parent: int) -> None:
    global _resource  # one per worker process
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent handles it
    end_with(parent)
    faulthandler.enable()  # the pool tells that a worker crashed, but not where
    _resource = make()


def _run(work: Callable[[Any, Part], Result], part: Part) -> Result:
    pin_threads()  # only now, for the part may have imported torch
    return work(_resource, part)
