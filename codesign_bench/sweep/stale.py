"""Cells that were run with other code than would run them now.

The own code of a cell's task and method decides its numbers: a cell that was run with other own code neither counts as
done nor resumes. Other code of the same packages may decide them, too, so that a difference is reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codesign_bench.cell.cell import Cell, ResolvedCell
from codesign_bench.errors import UserError
from codesign_bench.member_code import MemberCode, member_code
from codesign_bench.package_code import package_code
from codesign_bench.source_code import CORE
from codesign_bench.storage.provenance import code
from codesign_bench.storage.records import FAILED, CellRecord


@dataclass(frozen=True)
class StoredWith:
    """A cell that would run, and the record of a stored cell: its own, or that of the cell that it starts from."""

    resolved: ResolvedCell
    record: CellRecord

    def folder(self, out: Path) -> Path:
        """Return the folder of the stored cell below `out`."""
        record = self.record
        return Cell(record.task, record.method, record.seed, record.variant).folder(out)


def own_code(resolved: ResolvedCell) -> dict[str, MemberCode]:
    """Return the own code of a cell's task and method."""
    return {"task": member_code(type(resolved.task)), "method": member_code(resolved.method_class)}


def other_packages(resolved: ResolvedCell) -> dict[str, dict[str, Any]]:
    """Return the code of the packages of a cell's task and method; `code` of a record covers codesign-bench."""
    names = dict.fromkeys(code.package for code in own_code(resolved).values() if code.package != CORE)
    return {name: package_code(name).to_json() for name in names}


def changed_members(resolved: ResolvedCell, record: CellRecord) -> list[str]:
    """Return "task 'push' (modules that differ)", and the same of the method, where own code differs from a record's.

    What a record does not hold is no difference.
    """
    names, now = {"task": resolved.cell.task, "method": resolved.cell.method}, own_code(resolved)
    found = []
    for kind, stored in record.members.items():
        if kind in now and (changed := now[kind].changed_since(stored)):
            found.append(f"{kind} '{names[kind]}' ({', '.join(changed)})")
    return found


def pretrained(cells: Iterable[ResolvedCell], out: Path) -> list[StoredWith]:
    """Return the cells in `out` whose policies others start from."""
    found = []
    for resolved in cells:
        before = resolved.cell.pretrained
        record = None if before is None else CellRecord.read(before.folder(out))
        if record is not None:
            found.append(StoredWith(resolved, record))
    return found


def refuse_other_code(stored: Iterable[StoredWith], out: Path) -> None:
    """Refuse cells in `out` that would count as done, resume, or be started from, although their own code differs.

    Raises:
        UserError: there is one; names the first, what differs, and the ways out.
    """
    refused = [
        (one, changed)
        for one in stored
        if one.record.status != FAILED and (changed := changed_members(one.resolved, one.record))
    ]
    if refused:
        (first, changed), others = refused[0], len(refused) - 1
        more = f" (and {others} more cells)" * (others > 0)
        raise UserError(
            f"{first.folder(out)}{more} was run with other code of {' and '.join(changed)}\n"
            f"choose another --out, go back to that code ({_origin(first.record)}), or add --same-code if the change "
            "cannot change a number"
        )


def code_notes(stored: Sequence[StoredWith], *, retry_failed: bool) -> list[str]:
    """Return a line for each way in which the code differs, or may differ, from that of stored cells."""
    counted = [one for one in stored if one.record.status != FAILED]
    lines = _package_notes(counted)
    for kind, group in {
        "of an earlier version without a record of their task's and method's code: counted as before": [
            one for one in counted if not _is_known(one)
        ],
        "with other code of task or method: counted all the same (--same-code)": _changed(counted),
        "that failed with other code of task or method: started anew": _changed(stored, FAILED) if retry_failed else [],
    }.items():
        if group:
            lines.append(f"{_cells(group)} {kind}")
    return lines


def _changed(stored: Iterable[StoredWith], *statuses: str) -> list[StoredWith]:
    """Return the cells whose own code differs, of all statuses or of `statuses`."""
    chosen = [one for one in stored if not statuses or one.record.status in statuses]
    return [one for one in chosen if changed_members(one.resolved, one.record)]


def _is_known(one: StoredWith) -> bool:
    """Return whether the own code of a stored cell is recorded, or all code of codesign-bench is the same as now."""
    if one.record.members:
        return True
    built_in = all(code.package == CORE for code in own_code(one.resolved).values())
    return built_in and one.record.code.get("fingerprint") == package_code(CORE).fingerprint


def _package_notes(stored: Sequence[StoredWith]) -> list[str]:
    lines = []
    for name in dict.fromkeys((CORE, *(name for one in stored for name in one.record.packages))):
        now = package_code(name).to_json()
        same = (None, now["fingerprint"])
        other = [one for one in stored if _state(one.record, name).get("fingerprint") not in same]
        if other:
            states = dict.fromkeys(code({"code": _state(one.record, name)}) for one in other)
            lines.append(f"{_cells(other)} with other code of {name}: {', '.join(states)}; now {code({'code': now})}")
    return lines


def _state(record: CellRecord, package: str) -> Mapping[str, Any]:
    """Return what a record holds on the code of a package; empty if nothing."""
    return record.code if package == CORE else record.packages.get(package, {})


def _origin(record: CellRecord) -> str:
    packages = dict.fromkeys(code.package for code in record.members.values())
    return ", ".join(f"{name}: {code({'code': _state(record, name)})}" for name in packages)


def _cells(group: Sequence[StoredWith]) -> str:
    return f"{len(group)} stored cell{'s' * (len(group) != 1)}"
