"""Run a grid of cells: plan the missing cells, distribute them over workers, report the outcomes."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from rich.console import Console

from codesign_bench.cell.cell import Cell, ResolvedCell
from codesign_bench.config.run_settings import OVERSHOOT
from codesign_bench.console import Log, printer
from codesign_bench.errors import UserError
from codesign_bench.machine import available_cores
from codesign_bench.startup import IMPORTS_VARIABLE
from codesign_bench.storage.checkpoint import check_checkpoint
from codesign_bench.storage.layout import CHECKPOINT_FILE, CURVE_FILE, is_locked, open_folder
from codesign_bench.storage.records import DONE, FAILED, CellRecord
from codesign_bench.sweep.backends import Backend, WorkersDied, make_backend
from codesign_bench.sweep.progress import ProgressDisplay
from codesign_bench.sweep.workers import BUSY, Job, Outcome

EXIT_ALL_DONE, EXIT_SOME_FAILED = 0, 1
MAX_BROKEN_POOLS = 10
"""How many times in a row the worker processes may die before any cell ends."""
LOCK_POLL_SECONDS = 1.0


@dataclass(frozen=True)
class Plan:
    """The cells of a sweep by their state in the results folder."""

    done: list[Cell]
    failed: dict[Cell, str]
    """Cells that failed earlier and are not retried, with their error messages."""
    pending: list[ResolvedCell]


def make_plan(cells: Sequence[ResolvedCell], out: Path, *, retry_failed: bool = False) -> Plan:
    """Sort `cells` into done, failed and pending ones in `out`, before anything runs.

    Raises:
        UserError: a stored cell has another configuration, or a cell file or checkpoint is damaged.
    """
    plan = Plan([], {}, [])
    records = {resolved.cell: CellRecord.read(resolved.cell.folder(out)) for resolved in cells}
    _refuse_other_configurations(cells, records, out)
    _refuse_without_pretrained([resolved.cell for resolved in cells], out)
    for resolved in cells:
        cell = resolved.cell
        record = records[cell]
        if record is not None and record.status == DONE:
            plan.done.append(cell)
        elif record is not None and record.failure is not None and not retry_failed:
            plan.failed[cell] = record.failure.message
        else:
            check_checkpoint(cell.folder(out) / CHECKPOINT_FILE)  # a damaged one is reported here, not during the sweep
            plan.pending.append(resolved)
    return plan


def split_cores(cores: int, cells: int, threads: int, jobs: int | None) -> tuple[int, str]:
    """Return how many cells run at a time, and a message on the split of the cores.

    Args:
        cores: number of available cores.
        cells: number of cells to run.
        threads: threads of one cell.
        jobs: the requested number of cells at a time, or None; jobs x threads never exceeds the cores.

    Raises:
        UserError: one cell needs more threads than there are cores.
    """
    if threads > cores:
        raise UserError(f"--set threads={threads}: there are only {cores} cores")
    most = cores // threads
    used = max(1, min(most, cells, jobs or most))
    notice = f" (--jobs {jobs} would need more cores than there are)" if jobs is not None and jobs > most else ""
    return used, f"{used} at a time with {threads} thread{'s' * (threads > 1)} each on {cores} cores{notice}"


def run_sweep(
    cells: Sequence[ResolvedCell],
    out: Path,
    *,
    console: Console,
    jobs: int | None = None,
    retry_failed: bool = False,
    backend: str = "loky",
    scheduler: str | None = None,
) -> int:
    """Run every cell that is not done in `out`; return 0 if all are done at the end, 1 if some failed.

    Raises:
        UserError: bad input, found before anything runs.
        KeyboardInterrupt: the user stopped the sweep; its processes have ended, and the same call resumes it.
    """
    plan = make_plan(cells, out, retry_failed=retry_failed)
    threads = max((resolved.config.run.threads for resolved in cells), default=1)
    used_jobs, split = split_cores(available_cores(), len(plan.pending), threads, jobs)
    chosen = make_backend(backend, used_jobs, scheduler)
    open_folder(out)  # once nothing else can be refused: a refused sweep leaves no folder behind
    say = printer(console)
    say(f"{len(cells)} cells, {len(plan.done)} of them already done; results in {out}")
    failures = dict(plan.failed)
    if plan.pending:
        say(f"running {len(plan.pending)}: {split if scheduler is None else f'on the Dask cluster {scheduler}'}")
        say(f"cells finish their last episodes: at most {OVERSHOOT:.0%} over the budget, or one smallest batch")
        imported = os.environ.get(IMPORTS_VARIABLE, "")
        queue = [Job(resolved.cell, str(out), retry_failed, imported) for resolved in plan.pending]
        budgets = {resolved.cell: resolved.config.run.steps for resolved in plan.pending}
        with chosen as workers, ProgressDisplay(console, out, budgets, used_jobs) as display:
            failures |= _run_queue(queue, workers, display)
    return _conclude(say, len(cells), failures, plan.failed)


def _run_queue(queue: list[Job], workers: Backend, display: ProgressDisplay) -> dict[Cell, str]:
    """Run all jobs, those of cells that another sweep is running last; return the failures."""
    failures: dict[Cell, str] = {}
    waiting_told = False
    broken = 0
    while queue:
        free = [job for job in queue if not is_locked(job.cell.folder(Path(job.out)))]
        if not free:
            if not waiting_told:
                display.say(f"waiting for {len(queue)} cells that another sweep is running")
            waiting_told = True
            time.sleep(LOCK_POLL_SECONDS)
            continue
        ended = 0
        try:
            for outcome in workers.dispatch(free):
                if outcome.status != BUSY:
                    ended += 1
                    queue = [job for job in queue if job.cell != outcome.cell]
                    _tell(outcome, display, failures)
        except WorkersDied as error:
            broken = 0 if ended else broken + 1
            if broken == MAX_BROKEN_POOLS:
                raise RuntimeError("worker processes died repeatedly before any cell ended") from error
            display.say("a worker process died; unfinished cells resume from their checkpoints")
    return failures


def _tell(outcome: Outcome, display: ProgressDisplay, failures: dict[Cell, str]) -> None:
    display.ended(outcome.cell)
    if outcome.status == FAILED:
        failures[outcome.cell] = outcome.message
        display.say(f"failed  {outcome.cell.name}  {_one_line(outcome.message)}")
    else:
        display.say(
            f"done    {outcome.cell.name}  {_last_row(outcome.cell, display.out, display.budgets[outcome.cell])}"
        )


def _last_row(cell: Cell, out: Path, budget: int) -> str:
    last = pd.read_csv(cell.folder(out) / CURVE_FILE).iloc[-1]
    outcome = f"return {last['return_mean']:.2f}, success {last['success_rate']:.2f}"
    return f"{outcome}, {last['env_steps']:,.0f} steps{over(last['env_steps'], budget)}, {last['wall_s']:.0f} s"


def over(env_steps: float, budget: int) -> str:
    """Return by how much a cell has exceeded its budget to finish its last episodes, or nothing if by less than 1 %."""
    share = env_steps / budget - 1.0
    return f" ({share:.0%} over the budget)" if share >= 0.01 else ""


def _refuse_other_configurations(
    cells: Sequence[ResolvedCell], records: dict[Cell, CellRecord | None], out: Path
) -> None:
    refused = [
        (resolved.cell, different)
        for resolved in cells
        if (record := records[resolved.cell]) is not None
        and (different := resolved.differences(record.config, record.task_version))
    ]
    if refused:
        cell, different = refused[0]
        shown = "; ".join(different[:6]) + (f"; and {len(different) - 6} more" if len(different) > 6 else "")
        others = f" (and {len(refused) - 1} more cells)" if len(refused) > 1 else ""
        raise UserError(f"{cell.folder(out)}{others} was run with another configuration: {shown}\nchoose another --out")


def _refuse_without_pretrained(cells: Sequence[Cell], out: Path) -> None:
    for cell in cells:
        if (before := cell.pretrained) is not None:
            record = CellRecord.read(before.folder(out))
            if record is None or record.status != DONE:
                raise UserError(
                    f"{cell.name} starts from {before.name}, which is not done in {out}\nfirst run: "
                    f"codesign-bench run --method {cell.method} --task {cell.task} --seeds {cell.seed}-{cell.seed} "
                    f"--profile {cell.profile} --out {out}, with the same --set if any"
                )


def _conclude(say: Log, cells: int, failures: dict[Cell, str], earlier: dict[Cell, str]) -> int:
    for cell, message in earlier.items():
        say(f"failed earlier  {cell.name}  {_one_line(message)}")
    if not failures:
        say(f"all {cells} cells done")
        return EXIT_ALL_DONE
    hint = "; --retry-failed runs them again" if failures else ""
    say(f"{len(failures)} of {cells} cells failed; each cell.json has the traceback{hint}")
    return EXIT_SOME_FAILED


def _one_line(text: str) -> str:
    return " ".join(text.split())
