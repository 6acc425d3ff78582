"""Run a grid of cells: distribute those that are missing over workers, report the outcomes."""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from codesign_bench.cell.cell import Cell, ResolvedCell
from codesign_bench.config.run_settings import OVERSHOOT
from codesign_bench.console import JsonLines, Log, print_table, printer, tell
from codesign_bench.errors import UserError
from codesign_bench.machine import available_cores
from codesign_bench.startup import IMPORTS_VARIABLE
from codesign_bench.storage.layout import CURVE_COLUMNS, CURVE_FILE, open_folder, refuse_other_files, sweep_leftovers
from codesign_bench.storage.locks import HOLDER_FILE, has_locks, is_locked
from codesign_bench.storage.records import FAILED, INTERRUPTED
from codesign_bench.sweep.backends import Backend, ClusterLost, WorkersDied, make_backend
from codesign_bench.sweep.estimate import estimate, event_of, fitting, known_paces, row, untimed
from codesign_bench.sweep.pace import Kind, NotTimed, Pace, measure, remember
from codesign_bench.sweep.plan import Plan, make_plan
from codesign_bench.sweep.progress import ProgressDisplay
from codesign_bench.sweep.tensorboard import Follower, check_tensorboard
from codesign_bench.sweep.workers import BUSY, Job, Outcome

EXIT_ALL_DONE, EXIT_SOME_FAILED = 0, 1
MAX_BROKEN_POOLS = 10
"""How many times in a row the worker processes may die before any cell ends."""
LOCK_POLL_SECONDS = 1.0
UNREADABLE = (OSError, ValueError, LookupError, csv.Error)
"""What reading a curve raises if it is missing, cut off or damaged."""


@dataclass(frozen=True)
class Trouble:
    """The cells that are not done at the end of a sweep, with the reasons."""

    failed: dict[Cell, str]
    interrupted: dict[Cell, str]
    """Cells that the same command resumes."""

    def by_status(self) -> dict[str, dict[Cell, str]]:
        """Return status -> the cells that ended with it, with the reasons."""
        return {FAILED: self.failed, INTERRUPTED: self.interrupted}


def split_cores(cores: int, cells: int, threads: int, jobs: int | None, fit: int | None = None) -> tuple[int, str]:
    """Return how many cells run at a time, and a message on the split of the cores.

    Args:
        cores: number of available cores.
        cells: number of cells to run.
        threads: threads of one cell.
        jobs: the requested number of cells at a time, or None; jobs x threads never exceeds the cores.
        fit: how many cells fit in the memory, or None if that is unknown; a requested number overrides it.

    Raises:
        UserError: one cell needs more threads than there are cores.
    """
    if threads > cores:
        raise UserError(f"--set threads={threads}: there are only {cores} cores")
    most = cores // threads
    used = max(1, min(most, cells, jobs or fit or most))
    notice = f" (--jobs {jobs} would need more cores than there are)" if jobs is not None and jobs > most else ""
    if jobs is None and fit is not None and fit < min(most, cells):
        notice = " (more would not fit in the memory; --jobs overrides this)"
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
    same_code: bool = False,
    tensorboard: bool = False,
) -> int:
    """Run every cell that is not done in `out`; return 0 if all are done at the end, 1 if some failed.

    With `tensorboard`, their curves and metrics are also written as scalars, while they run.

    Raises:
        UserError: bad input, found before anything runs.
        KeyboardInterrupt: the user stopped the sweep; its processes have ended, and the same call resumes it.
    """
    plan = make_plan(cells, out, retry_failed=retry_failed, same_code=same_code)
    if tensorboard:
        check_tensorboard()
    known = known_paces(out)
    used_jobs, split = _split(cells, plan, jobs, known)
    chosen = make_backend(backend, used_jobs, scheduler)
    say, trouble = printer(console), Trouble(plan.failed | plan.unusable, dict(plan.unreadable))
    with chosen if plan.pending else nullcontext() as workers:
        open_folder(out)  # once nothing else can be refused: a refused sweep leaves no folder behind
        _begin(say, len(cells), plan, out)
        if workers is not None:
            say(f"running {len(plan.pending)}: {split if scheduler is None else f'on the Dask cluster {scheduler}'}")
            expected = estimate(plan.pending, used_jobs, known)
            if scheduler is None:  # the machines of a cluster may be of any speed
                say(expected.line())
            tell(
                console, "begin", cells=len(cells), done=len(plan.done), to_run=len(plan.pending), **expected.to_json()
            )
            say(f"cells finish their last episodes: at most {OVERSHOOT:.0%} over the budget, or one smallest batch")
            imported = os.environ.get(IMPORTS_VARIABLE, "")
            queue = [Job(pending.cell, str(out), retry_failed, imported, same_code) for pending in plan.pending]
            budgets = {pending.cell: pending.resolved.config.run.steps for pending in plan.pending}
            followed = Follower(list(budgets), out) if tensorboard else nullcontext()
            with followed, ProgressDisplay(console, out, budgets, used_jobs) as display:
                _run_queue(queue, workers, display, trouble)
    code = _conclude(say, len(cells), trouble, plan)
    named = {status: [cell.name for cell in given] for status, given in trouble.by_status().items()}
    tell(console, "end", exit_code=code, cells=len(cells), **named)
    return code


def dry_run(
    cells: Sequence[ResolvedCell],
    out: Path,
    *,
    console: Console,
    jobs: int | None = None,
    retry_failed: bool = False,
    same_code: bool = False,
    most_timed: int | None = None,
) -> int:
    """Print what `run_sweep` would do with every cell, and how long it would take; return 0.

    Kinds of cells that have not been timed on this machine are, for some seconds each, outside of `out`; only the first
    `most_timed` of them if that is not None. Cells may start from others among `cells`, as in stages that follow.

    Raises:
        UserError: the same that `run_sweep` raises before anything runs.
    """
    if out.exists():
        try:
            refuse_other_files(out)
        except OSError as error:
            raise UserError(f"--out {out}: not readable ({error.strerror})") from error
    together = {cell.cell.name for cell in cells}
    plan = make_plan(cells, out, retry_failed=retry_failed, same_code=same_code, promised=together)
    say, known = printer(console), known_paces(out)
    for kind, pending in list(untimed(plan.pending, known).items())[:most_timed]:
        say(f"timing {pending.cell.task}/{pending.cell.method} ...")
        try:
            known[kind] = measure(pending.resolved)[0]
            remember({kind: known[kind]})
        except NotTimed as error:
            say(str(error))
    used_jobs, split = _split(cells, plan, jobs, known)
    expected = estimate(plan.pending, used_jobs, known)
    settled = {
        **dict.fromkeys(plan.done, "done"),
        **dict.fromkeys(plan.failed, "failed earlier"),
        **dict.fromkeys(plan.unusable, "cannot be used"),
        **dict.fromkeys(plan.unreadable, "cannot be read"),
    }
    to_run = {each.pending.cell: each for each in expected.cells}
    if isinstance(console, JsonLines):
        for cell in (resolved.cell for resolved in cells):
            known_of = event_of(to_run[cell]) if cell in to_run else {"cell": cell.name, "state": settled[cell]}
            tell(console, "planned", **known_of)
        tell(console, "plan", **_counts(cells, plan), **expected.to_json())
    else:
        rows = [
            row(to_run[cell.cell]) if cell.cell in to_run else (cell.cell.name, settled[cell.cell], "", "", "", "")
            for cell in cells
        ]
        print_table(console, ("cell", "state", "steps", "time", "memory", "known from"), rows)
    for note in plan.notes:
        say(note)
    say(f"{len(cells)} cells, {len(plan.pending)} to run{f': {split}' if plan.pending else ''}")
    if plan.pending:
        say(expected.line())
    say("nothing was run")
    return EXIT_ALL_DONE


def _split(cells: Sequence[ResolvedCell], plan: Plan, jobs: int | None, known: Mapping[Kind, Pace]) -> tuple[int, str]:
    """Return how many of the pending cells run at a time, and a message on it."""
    threads = max((resolved.config.run.threads for resolved in cells), default=1)
    return split_cores(available_cores(), len(plan.pending), threads, jobs, fitting(plan.pending, known))


def _counts(cells: Sequence[ResolvedCell], plan: Plan) -> dict[str, int]:
    return {"cells": len(cells), "done": len(plan.done), "to_run": len(plan.pending)}


def _begin(say: Log, cells: int, plan: Plan, out: Path) -> None:
    """Say what there is in the folder, and sweep what killed processes have left there."""
    say(f"{cells} cells, {len(plan.done)} of them already done; results in {out}")
    for note in plan.notes:
        say(note)
    for cell in plan.done:
        sweep_leftovers(cell.folder(out))
    if plan.pending and not has_locks(out):
        say(f"the file system of {out} has no locks: each running cell is guarded by a file, {HOLDER_FILE}")


def _run_queue(queue: list[Job], workers: Backend, display: ProgressDisplay, trouble: Trouble) -> None:
    """Run all jobs, those of cells that another sweep is running last; add to the trouble."""
    waiting_told = False
    broken = 0
    while queue:
        free = [job for job in queue if not is_locked(job.cell.folder(Path(job.out)))]
        if not free:
            if not waiting_told:
                display.say(f"waiting for {len(queue)} cells that another sweep is running{_holders(queue)}")
            waiting_told = True
            time.sleep(LOCK_POLL_SECONDS)
            continue
        ended = 0
        try:
            for outcome in workers.dispatch(free):
                if outcome.status != BUSY:
                    ended += 1
                    queue = [job for job in queue if job.cell != outcome.cell]
                    _tell(outcome, display, trouble)
        except ClusterLost as error:
            display.say(str(error))
            trouble.interrupted.update((job.cell, str(error)) for job in queue)
            return
        except WorkersDied as error:
            broken = 0 if ended else broken + 1
            if broken == MAX_BROKEN_POOLS:
                raise RuntimeError("worker processes died repeatedly before any cell ended") from error
            display.say("a worker process died; unfinished cells resume from their checkpoints")


def _holders(queue: Sequence[Job]) -> str:
    """Return where to look if no other sweep is running: files guard cells where the file system has no locks."""
    files = [file for job in queue if (file := job.cell.folder(Path(job.out)) / HOLDER_FILE).exists()]
    return f"; if none is, remove {files[0]}, which names its host and process" if files else ""


def _tell(outcome: Outcome, display: ProgressDisplay, trouble: Trouble) -> None:
    display.ended(outcome.cell)
    if isinstance(display.console, JsonLines):
        event: dict[str, object] = {
            "cell": outcome.cell.name,
            "status": outcome.status,
            "message": _one_line(outcome.message),
        }
        with suppress(*UNREADABLE):
            event |= _last_values(outcome.cell, display.out)
        display.console.event("cell", event)
    if outcome.status == FAILED:
        trouble.failed[outcome.cell] = outcome.message
        display.say(f"failed  {outcome.cell.name}  {_one_line(outcome.message)}")
    elif outcome.status == INTERRUPTED:
        trouble.interrupted[outcome.cell] = outcome.message
        display.say(f"interrupted  {outcome.cell.name}  {_one_line(outcome.message)}")
    else:
        display.say(
            f"done    {outcome.cell.name}  {last_row(outcome.cell, display.out, display.budgets[outcome.cell])}"
        )


def _last_values(cell: Cell, out: Path) -> dict[str, float]:
    """Return the last row of a cell's curve.

    Raises:
        one of `UNREADABLE`.
    """
    # Not with pandas: a cell may run in this process, and would take 33 MB more.
    with (cell.folder(out) / CURVE_FILE).open(newline="", encoding="utf-8") as file:
        last = list(csv.DictReader(file, restval="cut off"))[-1]
    return {name: float(last[name] or "nan") for name in CURVE_COLUMNS}


def last_row(cell: Cell, out: Path, budget: int) -> str:
    """Return in words what a cell has reached at the end of its curve, or why that cannot be read."""
    try:
        last = _last_values(cell, out)
    except UNREADABLE as error:
        return f"its curve cannot be read ({_one_line(str(error))})"
    outcome = f"return {last['return_mean']:.2f}, success {last['success_rate']:.2f}"
    return f"{outcome}, {last['env_steps']:,.0f} steps{over(last['env_steps'], budget)}, {last['wall_s']:.0f} s"


def over(env_steps: float, budget: int) -> str:
    """Return by how much a cell has exceeded its budget to finish its last episodes, or nothing if by less than 1 %."""
    share = env_steps / budget - 1.0
    return f" ({share:.0%} over the budget)" if share >= 0.01 else ""


def _conclude(say: Log, cells: int, trouble: Trouble, plan: Plan) -> int:
    for cell, message in plan.failed.items():
        say(f"failed earlier  {cell.name}  {_one_line(message)}")
    for cell, message in plan.unusable.items():
        say(f"failed  {cell.name}  {_one_line(message)}")
    for cell, message in plan.unreadable.items():
        say(f"interrupted  {cell.name}  {_one_line(message)}")
    if trouble.interrupted:
        say(f"{len(trouble.interrupted)} of {cells} cells interrupted; the same command resumes them")
    if trouble.failed:
        began = set(trouble.failed) - set(plan.unusable)
        advice = "; cell.json has the traceback of each that began, and --retry-failed runs it again" if began else ""
        say(f"{len(trouble.failed)} of {cells} cells failed{advice}")
    if trouble.failed or trouble.interrupted:
        return EXIT_SOME_FAILED
    say(f"all {cells} cells done")
    return EXIT_ALL_DONE


def _one_line(text: str) -> str:
    return " ".join(text.split())
