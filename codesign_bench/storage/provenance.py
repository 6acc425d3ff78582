"""How the cells of one or several results folders were made, where that differs and can change numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from codesign_bench.storage.cells import StoredCell
from codesign_bench.storage.records import CellRecord
from codesign_bench.text_tables import plain_markdown

NOT_RECORDED = "not recorded"
SHORT = 12
"""Digits of a commit or a fingerprint that are shown."""
NO_LIBRARIES = ("codesign_bench",)
"""Versions that tell of the code."""
HEADING = "These cells are not known to have been made alike, so equal seeds need not give equal numbers:"

Conditions = Mapping[str, Any]
"""`CellRecord.conditions`."""
Origin = tuple[str, CellRecord]
"""The name of a results folder, and the record of a cell in it."""

TELLING: tuple[Callable[[Origin], str], ...] = (
    lambda cell: cell[0],
    lambda cell: cell[1].task,
    lambda cell: cell[1].method,
    lambda cell: cell[1].variant.name,
)
"""What tells some cells apart from the others: their folder, task, method or variant."""
MOST_NAMES = 3


def records_of(cells: Iterable[StoredCell]) -> list[CellRecord]:
    """Return the records of finished cells."""
    return [cell.record for cell in cells if cell.is_done]


def differences(folders: Mapping[str, Sequence[CellRecord]]) -> list[str]:
    """Return a short paragraph: a heading and one line per kind of difference that can change numbers; or nothing.

    Args:
        folders: name of a results folder -> its cells. With a single folder, its name is not shown.
    """
    cells = [(name, record) for name, records in folders.items() for record in records]
    lines = [
        _code_line(cells),
        _changes_line(cells),
        *_package_lines(cells),
        _processor_line(cells),
        _library_line(cells),
        _resumed_line(cells),
    ]
    found = [line for line in lines if line]
    return [HEADING, *found] if found else []


def as_markdown(paragraph: Sequence[str]) -> str:
    """Return what `differences` found as Markdown."""
    heading, *lines = paragraph
    return "\n".join([heading, "", *(f"- {plain_markdown(line)}" for line in lines)]) + "\n"


def same_conditions(one: Conditions, other: Conditions) -> bool:
    """Return whether two parts of training had the same code, processor and libraries, as far as is recorded."""
    same_code = one["code"].get("fingerprint") == other["code"].get("fingerprint")
    return (
        same_code
        and not _other_code(one, other)
        and one["versions"] == other["versions"]
        and processor(one) == processor(other)
    )


def _other_code(one: Conditions, other: Conditions) -> bool:
    """Return whether code of packages, or own code of task or method, differs where both parts record it."""
    for entry, told in (("packages", "fingerprint"), ("members", "files")):
        first, second = one.get(entry, {}), other.get(entry, {})
        if any(first[name].get(told) != second[name].get(told) for name in first.keys() & second.keys()):
            return True
    return False


def code(conditions: Conditions) -> str:
    """Return which code it was: its commit, or the fingerprint of its files where no commit says it all."""
    told = conditions["code"]
    files = f"files {(told.get('fingerprint') or '')[:SHORT]}"
    if told.get("commit") is None:
        return files if told.get("fingerprint") else NOT_RECORDED
    return told["commit"][:SHORT] + (f" with changes ({files})" if told.get("changed") else "")


def processor(conditions: Conditions) -> str:
    """Return the processor, its instruction sets, and what restricts these."""
    host = conditions["host"]
    if host.get("cpu") is None:
        return NOT_RECORDED
    sets = host.get("instruction_sets")
    told = "instruction sets not recorded" if sets is None else ", ".join(sets) or "none of the known instruction sets"
    settings = [f"{name}={value}" for name, value in sorted((host.get("library_settings") or {}).items())]
    return f"{host['cpu']} ({'; '.join([told, *settings])})"


def _code_line(cells: Sequence[Origin]) -> str:
    prints = {record.code.get("fingerprint") for _, record in cells}
    if len(prints) < 2 and None not in prints:  # commits that differ only in other files give the same numbers
        return ""
    return f"commits: {_counted(cells, lambda record: code(record.conditions))}"


def _changes_line(cells: Sequence[Origin]) -> str:
    changed = [cell for cell in cells if cell[1].code.get("changed")]
    return f"changes that are in no commit: {_cells(changed, cells)}" if changed else ""


def _package_lines(cells: Sequence[Origin]) -> list[str]:
    """Return a line for each package of other members whose code differs between the cells that record it."""
    lines = []
    for name in dict.fromkeys(name for _, record in cells for name in record.packages):
        having = [cell for cell in cells if name in cell[1].packages]

        def told(record: CellRecord, name: str = name) -> str:
            return code({"code": record.packages[name]})

        if len({record.packages[name].get("fingerprint") for _, record in having}) > 1:
            lines.append(f"commits of {name}: {_counted(having, told)}")
    return lines


def _processor_line(cells: Sequence[Origin]) -> str:
    if len({processor(record.conditions) for _, record in cells}) < 2:
        return ""
    return f"processors: {_counted(cells, lambda record: processor(record.conditions))}"


def _library_line(cells: Sequence[Origin]) -> str:
    parts = []
    for name in dict.fromkeys(name for _, record in cells for name in record.versions if name not in NO_LIBRARIES):
        # A package that old cells do not record is no difference.
        having = [cell for cell in cells if name in cell[1].versions]

        def version(record: CellRecord, name: str = name) -> str:
            return record.versions[name] or "not installed"

        if len({version(record) for _, record in having}) > 1:
            parts.append(f"{name} {_counted(having, version)}")
    return f"libraries: {'; '.join(parts)}" if parts else ""


def _resumed_line(cells: Sequence[Origin]) -> str:
    mixed = [cell for cell in cells if cell[1].earlier]
    return f"resumed under other code, processors or libraries than begun: {_cells(mixed, cells)}" if mixed else ""


def _counted(cells: Sequence[Origin], value: Callable[[CellRecord], str]) -> str:
    """Return each value with its cells, the most frequent first."""
    groups: dict[str, list[Origin]] = {}
    for cell in cells:
        groups.setdefault(value(cell[1]), []).append(cell)
    ordered = sorted(groups.items(), key=lambda group: -len(group[1]))
    return ", ".join(f"{told} ({_cells(group, cells)})" for told, group in ordered)


def _cells(group: Sequence[Origin], everything: Sequence[Origin]) -> str:
    """Return the number of cells, with what tells them apart from the others if few words can: "6 cells of push"."""
    count = f"{len(group)} cell{'s' * (len(group) != 1)}"
    if len(group) == len(everything):
        return f"all {count}"
    chosen = {id(record) for _, record in group}
    rest = [cell for cell in everything if id(cell[1]) not in chosen]
    for key in TELLING:
        names = {key(cell) for cell in group}
        if len(names) <= MOST_NAMES and not names & {key(cell) for cell in rest}:
            return f"{count} of {', '.join(sorted(names))}"
    return count
