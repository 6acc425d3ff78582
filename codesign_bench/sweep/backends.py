"""Backends that run the cells of a sweep: worker processes of this machine, by joblib, or a Dask cluster.

A backend yields the outcomes of jobs as they end, and stops everything that it started on every exit. If workers die,
it raises `WorkersDied`; unfinished jobs resume from their checkpoints when they are dispatched again.
"""

from __future__ import annotations

import asyncio
import logging
import os
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from joblib import Parallel, delayed
from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.process_executor import BrokenProcessPool

from codesign_bench.errors import UserError
from codesign_bench.sweep.workers import Job, Outcome, prepare_worker, run_job

BACKENDS = ("loky", "dask")
CONNECT_SECONDS = 10.0
TALKATIVE = ("distributed", "tornado", "asyncio")
"""Libraries below Dask that log what happens to connections."""
WORKER_SECONDS = 30.0
"""How long a cluster may take until a first worker answers."""


class WorkersDied(Exception):
    """Worker processes died during their jobs."""


class ClusterLost(Exception):
    """The cluster has gone; cells that it was running are interrupted. The message says which."""


class Backend(ABC):
    """A context manager that runs jobs."""

    def __enter__(self) -> Backend:
        return self

    @abstractmethod
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop everything that the backend started."""

    @abstractmethod
    def dispatch(self, queue: Sequence[Job]) -> Iterator[Outcome]:
        """Yield the outcomes of jobs as they end.

        Raises:
            WorkersDied: workers died, and some jobs have no outcome.
        """


class LokyBackend(Backend):
    """Worker processes of this machine, `jobs` of them."""

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Do nothing: joblib reuses the idle workers and ends them with this process."""

    def dispatch(self, queue: Sequence[Job]) -> Iterator[Outcome]:
        """Yield the outcomes of jobs as they end."""
        pool = Parallel(
            n_jobs=self.jobs,
            backend="loky",
            return_as="generator_unordered",
            batch_size=1,
            pre_dispatch=self.jobs,
            initializer=prepare_worker,
            initargs=(os.getpid(),),
        )
        try:
            yield from pool(delayed(run_job)(job) for job in queue)
        except BaseException as error:
            if self.jobs > 1:
                get_reusable_executor().shutdown(wait=False, kill_workers=True)
            if isinstance(error, BrokenProcessPool):
                raise WorkersDied from error
            raise


class DaskBackend(Backend):
    """The workers of a Dask cluster: that of `scheduler`, or a local one with `jobs` workers.

    All workers must see the results folder under the same path. joblib is left out here: given a single worker, it
    would run the cells in this process instead.
    """

    def __init__(self, jobs: int, scheduler: str | None) -> None:
        self.jobs, self.scheduler = jobs, scheduler
        self._stack = ExitStack()
        self._client: Any = None

    def __enter__(self) -> Backend:
        """Connect, and wait for a worker.

        Raises:
            UserError: Dask is not installed, the scheduler cannot be reached, or it has no worker.
        """
        try:
            from distributed import Client, LocalCluster
        except ModuleNotFoundError as error:
            raise UserError("--backend dask needs Dask: pip install 'codesign-bench[dask]'") from error
        with ExitStack() as stack:
            stack.enter_context(_quiet())
            where: Any = self.scheduler
            if where is None:
                cluster = LocalCluster(n_workers=self.jobs, threads_per_worker=1, dashboard_address=None)
                where = stack.enter_context(cluster)
            try:
                self._client = stack.enter_context(Client(where, timeout=CONNECT_SECONDS, set_as_default=False))
            except (OSError, ValueError) as error:
                raise UserError(f"--scheduler {self.scheduler}: no Dask scheduler answers at this address") from error
            self._wait_for_a_worker()
            self._stack = stack.pop_all()
        return self

    def _wait_for_a_worker(self) -> None:
        """Wait until a worker has done something.

        Raises:
            UserError: none has.
        """
        try:
            self._client.submit(os.getpid, pure=False).result(timeout=WORKER_SECONDS)  # an adaptive cluster grows
        except asyncio.TimeoutError as error:  # another class than TimeoutError up to Python 3.10
            start = f"dask worker {self.scheduler} --nthreads 1"
            raise UserError(f"--scheduler {self.scheduler}: it has no worker; start one with: {start}") from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Disconnect; stop the cluster if it is a local one."""
        self._stack.close()

    def dispatch(self, queue: Sequence[Job]) -> Iterator[Outcome]:
        """Yield the outcomes of jobs as they end; Dask moves the job of a dead worker to another worker.

        Raises:
            WorkersDied: several workers died in the same job.
            ClusterLost: the scheduler has gone.
        """
        from distributed import as_completed
        from distributed.scheduler import KilledWorker

        jobs = [replace(job, out=str(Path(job.out).resolve())) for job in queue]
        died: BaseException | None = None
        for future in as_completed(self._client.map(run_job, jobs, pure=False), loop=self._client.loop):
            try:
                outcome: Outcome = future.result()
            except KilledWorker as error:
                died = error
            except CancelledError as error:
                raise ClusterLost(f"the Dask scheduler {self.scheduler or 'of this machine'} has gone") from error
            else:
                yield outcome
        if died is not None:
            raise WorkersDied from died


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's own messages off the screen: one line of ours says what matters."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in TALKATIVE]
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def make_backend(name: str, jobs: int, scheduler: str | None) -> Backend:
    """Return the backend `name`.

    Raises:
        UserError: an unknown name, or a scheduler for a backend that uses none.
    """
    if name == "dask":
        return DaskBackend(jobs, scheduler)
    if name != "loky":
        raise UserError(f"--backend {name}: choose from: {', '.join(BACKENDS)}")
    if scheduler is not None:
        raise UserError("--scheduler needs --backend dask")
    return LokyBackend(jobs)
