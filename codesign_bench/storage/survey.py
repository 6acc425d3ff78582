"""What of a results folder cannot be used: every file that a command would read, checked as the command reads it."""

from __future__ import annotations

from pathlib import Path

from codesign_bench.errors import UserError
from codesign_bench.storage.cells import Contents, scan
from codesign_bench.storage.measurements import ALL, paths_of
from codesign_bench.storage.reading import DamagedFile, UnusableFile, is_there
from codesign_bench.storage.tables import Measurements, read_table


def survey(results: Path, contents: Contents | None = None) -> list[UnusableFile]:
    """Return what cannot be used below `results`: cells, their files, and tables beside the cells.

    Args:
        results: a results folder; nothing is returned if there is none.
        contents: from `scan`, so that cells that were read are not read again.
    """
    if not is_there(results):
        return []
    try:
        found = scan(results) if contents is None else contents
    except UserError as error:
        return [error] if isinstance(error, UnusableFile) else []
    of_cells = [problem for cell in found.cells for problem in cell.problems]
    return [*found.unusable, *of_cells, *(problem for kind in ALL for problem in _unusable(results, kind))]


def _unusable(results: Path, kind: Measurements) -> list[UnusableFile]:
    """Return the tables of a kind that cannot be used."""
    problems: list[UnusableFile] = []
    folder, paths = results / Path(kind.pattern).parts[0], paths_of(results, kind)
    if not paths and folder.name != kind.pattern and is_there(folder) and not folder.is_dir():
        problems.append(DamagedFile(folder, "it is not a folder"))
    for path in paths:
        try:
            read_table(path, kind.form)
        except UnusableFile as error:
            problems.append(error)
    return problems


def lines(results: Path, problems: list[UnusableFile]) -> list[str]:
    """Return a short line for each problem: its path below the folder, and the reason."""
    return [f"{_below(results, problem.path)}: {problem.reason}" for problem in problems]


def _below(results: Path, path: Path) -> str:
    return path.relative_to(results).as_posix() if path.is_relative_to(results) else str(path)
