"""Processes that share work, each with a resource of its own that is made once.

The caller cuts the work into parts. Their number must not depend on that of the processes: then results do not either.
"""

from __future__ import annotations

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
        return list(self._pool.map(partial(_run, work), parts))


def _prepare(make: Callable[[], Any], parent: int) -> None:
    global _resource  # one per worker process
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent handles it
    end_with(parent)
    _resource = make()


def _run(work: Callable[[Any, Part], Result], part: Part) -> Result:
    pin_threads()  # only now, for the part may have imported torch
    return work(_resource, part)
