"""Which cells of a sweep are done, failed or to be run, before anything runs."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from codesign_bench.cell.cell import Cell, ResolvedCell
from codesign_bench.errors import UserError
from codesign_bench.storage.cells import StoredCell, stored_record
from codesign_bench.storage.checkpoint import check_checkpoint
from codesign_bench.storage.layout import CHECKPOINT_FILE
from codesign_bench.storage.reading import DamagedFile
from codesign_bench.storage.records import DONE, CellRecord
from codesign_bench.storage.system_errors import momentary_cause
from codesign_bench.sweep.stale import StoredWith, code_notes, pretrained, refuse_other_code


@dataclass(frozen=True)
class Pending:
    """A cell to be run."""

    resolved: ResolvedCell
    env_steps: int
    """Of the checkpoint from which it resumes; 0: it starts anew."""

    @property
    def cell(self) -> Cell:
        """The cell itself."""
        return self.resolved.cell


@dataclass(frozen=True)
class Plan:
    """The cells of a sweep by their state in the results folder."""

    done: list[Cell]
    failed: dict[Cell, str]
    """Cells that failed earlier and are not retried, with their error messages."""
    unusable: dict[Cell, str]
    """Cells whose files are damaged or refused, with the reasons."""
    unreadable: dict[Cell, str]
    """Cells whose files cannot be read at the moment, with the reasons."""
    pending: list[Pending]
    notes: list[str]
    """How the code differs from that of stored cells, one line each."""


def make_plan(
    cells: Sequence[ResolvedCell],
    out: Path,
    *,
    retry_failed: bool = False,
    same_code: bool = False,
    promised: Collection[str] = (),
) -> Plan:
    """Sort `cells` into done, failed and pending ones in `out`, before anything runs.

    Cells may start from others that are not done yet if these, given by their names, are `promised`.

    Raises:
        UserError: a stored cell has another configuration, was run with other code of its task or method (unless
            `same_code` says that this makes no difference), or one that cells start from is not done.
    """
    plan = Plan([], {}, {}, {}, [], [])
    records: dict[Cell, CellRecord | None] = {}
    for resolved in cells:
        try:
            records[resolved.cell] = stored_record(resolved.cell, out)
        except UserError as error:
            _set_aside(plan, resolved.cell, error)
    readable = [resolved for resolved in cells if resolved.cell in records]
    _refuse_other_configurations(readable, records, out)
    _refuse_without_pretrained([resolved.cell for resolved in readable], out, promised)
    stored = [StoredWith(resolved, record) for resolved in readable if (record := records[resolved.cell]) is not None]
    if not same_code:
        refuse_other_code([*stored, *pretrained(readable, out)], out)
    plan.notes.extend(code_notes(stored, retry_failed=retry_failed))
    for resolved in readable:
        _sort_into(plan, resolved, records[resolved.cell], out, retry_failed=retry_failed)
    return plan


def _sort_into(plan: Plan, resolved: ResolvedCell, record: CellRecord | None, out: Path, *, retry_failed: bool) -> None:
    cell = resolved.cell
    if record is not None and record.status == DONE and (problems := _problems(cell, record, out)):
        plan.unusable[cell] = f"is done, but cannot be used: {problems}"
    elif record is not None and record.status == DONE:
        plan.done.append(cell)
    elif record is not None and record.failure is not None and not retry_failed:
        plan.failed[cell] = record.failure.message
    else:
        try:
            env_steps = check_checkpoint(cell.folder(out) / CHECKPOINT_FILE)  # reported before the sweep
        except UserError as error:
            _set_aside(plan, cell, error)
        else:
            plan.pending.append(Pending(resolved, env_steps))


def _set_aside(plan: Plan, cell: Cell, error: UserError) -> None:
    cells = plan.unusable if momentary_cause(error) is None else plan.unreadable
    cells[cell] = str(error)


def _problems(cell: Cell, record: CellRecord, out: Path) -> str:
    """Return which files of a finished cell cannot be used, and why; "" if all can."""
    problems = StoredCell(cell.folder(out), record).problems
    reasons = [f"{problem.path.name}: {problem.reason}" for problem in problems]
    if problems and all(isinstance(problem, DamagedFile) for problem in problems):
        reasons.append("delete its folder to run it again")
    return "; ".join(reasons)


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


def _refuse_without_pretrained(cells: Sequence[Cell], out: Path, promised: Collection[str]) -> None:
    for cell in cells:
        if (before := cell.pretrained) is not None and before.name not in promised:
            record = CellRecord.read(before.folder(out))
            if record is None or record.status != DONE:
                raise UserError(
                    f"{cell.name} starts from {before.name}, which is not done in {out}\nfirst run: "
                    f"codesign-bench run --method {cell.method} --task {cell.task} --seeds {cell.seed}-{cell.seed} "
                    f"--profile {cell.profile} --out {out}, with the same --steps and --set if any"
                )
