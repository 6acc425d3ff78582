"""Where results are that an argument names: a folder, an archive that `pack` wrote, or the shipped results by name.

Every command and function that reads results finds them here. A folder comes first, so that a path never changes its
meaning; then `FILE.zip`, which is unpacked to a temporary folder for the life of the process; then `reference`, the
results of the package `codesign-bench-reference`, or those of a checkout.
"""

from __future__ import annotations

import os
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from codesign_bench.errors import UserError
from codesign_bench.storage.archive import SUFFIX, is_archive, unpack
from codesign_bench.storage.files import reason_of
from codesign_bench.storage.layout import MARKER_FILE
from codesign_bench.storage.records import CELL_FILE
from codesign_bench.visible_text import on_one_line

REFERENCE = "reference"
"""The name of the shipped results."""
PACKAGE = "codesign_bench_reference"
"""The module path of the package that has them; nothing of it is executed."""
INSTALL = "pip install codesign-bench-reference"
IN_CHECKOUT = Path("results") / REFERENCE
KINDS = f"a folder of results, an archive that `codesign-bench pack` wrote, or {REFERENCE}"
MOST_CHOICES = 12
"""Names that a message lists."""


def results_folder(given: str | Path, *, must_exist: bool = False) -> Path:
    """Return the folder of the results that an argument names.

    Args:
        given: a folder, an archive or `reference`.
        must_exist: refuse a folder that does not exist; otherwise the caller says what its absence means.

    Raises:
        UnusableFile: the archive is damaged or cannot be read.
        UserError: there is no such archive, or the shipped results are not installed.
    """
    path = Path(given)
    if os.path.isdir(path):
        return path
    if path.suffix.lower() == SUFFIX:
        return unpacked(path)
    if os.path.lexists(path):
        return path
    if path == Path(REFERENCE):
        return reference_folder()
    if path.parts[-2:] == IN_CHECKOUT.parts:
        raise UserError(_by_name(path))
    if must_exist:
        raise UserError(f"no results folder '{on_one_line(str(path))}'; give {KINDS}")
    return path


def cell_folder(given: str | Path) -> Path:
    """Return the folder of the cell that an argument names.

    Args:
        given: a folder, or `<results>/<task>/<method>/<variant>/seed-00`, where results are an archive or `reference`.

    Raises:
        UnusableFile: the archive is damaged or cannot be read.
        UserError: these results have no such cell, or are not installed.
    """
    path = Path(given)
    if os.path.lexists(path):
        return path
    for prefix in reversed(path.parents):
        if prefix.suffix.lower() == SUFFIX and not os.path.isdir(prefix):
            return _cell_in(unpacked(prefix), path.relative_to(prefix), prefix)
    if path.parts[:1] == (REFERENCE,) and not os.path.lexists(REFERENCE):
        return _cell_in(reference_folder(), path.relative_to(REFERENCE), Path(REFERENCE))
    if path.parts[:2] == IN_CHECKOUT.parts and not os.path.lexists(IN_CHECKOUT):
        raise UserError(_by_name(IN_CHECKOUT))
    return path


def reference_folder() -> Path:
    """Return the folder of the shipped results: those of the installed package, or else of the checkout.

    Raises:
        UserError: there are none; says how to install them.
    """
    found = _installed() or _checked_out()
    if found is None:
        raise UserError(f"the results '{REFERENCE}' are not installed; install them with: {INSTALL}")
    return found


def unpacked(path: Path) -> Path:
    """Return the temporary folder of an archive's files, which is unpacked once per process and removed at its end.

    Raises:
        UnusableFile: the archive is damaged or cannot be read.
        UserError: there is no such file, or the system refuses the folder.
    """
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:
        name = on_one_line(str(path))
        raise UserError(f"no archive '{name}'; write one with: codesign-bench pack RUNS --out {name}") from error
    return Path(_unpacked(path, found.st_ino, found.st_size, found.st_mtime_ns).name) / path.stem


def shown(folder: Path) -> str:
    """Return the name of results for a reader: that of an archive, or else the path of the folder."""
    return folder.name if is_archive(folder) else str(folder)


@cache
def _unpacked(path: Path, *version: int) -> tempfile.TemporaryDirectory[str]:
    del version  # tells a file from one that replaced it
    try:
        target = tempfile.TemporaryDirectory(prefix="codesign-bench-")
        unpack(path, Path(target.name) / path.stem)
    except FileNotFoundError as error:
        raise UserError(f"no archive '{on_one_line(str(path))}'") from error
    except OSError as error:
        raise UserError(f"cannot unpack '{on_one_line(str(path))}' ({reason_of(error)})") from error
    return target


def _installed() -> Path | None:
    """Return the folder of the package with the shipped results, which is found without importing it."""
    try:
        spec = find_spec(PACKAGE)
    except (ImportError, ValueError):
        return None
    for place in (spec.submodule_search_locations or ()) if spec is not None else ():
        if (Path(place) / REFERENCE / MARKER_FILE).exists():
            return Path(place) / REFERENCE
    return None


def _checked_out() -> Path | None:
    """Return the shipped results beside the code, where it is a checkout."""
    folder = Path(__file__).resolve().parents[2] / IN_CHECKOUT
    return folder if (folder / MARKER_FILE).exists() else None


def _by_name(path: Path) -> str:
    """Return the message for a path of the checkout where there is no checkout."""
    first = "" if _installed() or _checked_out() else f" (first: {INSTALL})"
    return f"no results folder '{on_one_line(str(path))}'; the shipped results are found by name: {REFERENCE}{first}"


def _cell_in(results: Path, cell: Path, name: Path) -> Path:
    """Return the folder of a cell below `results`, which a user knows by `name`.

    Raises:
        UserError: there is none; names what there is instead.
    """
    if ".." in cell.parts:
        raise UserError(f"'{on_one_line(str(name / cell))}' is not a cell")
    if (results / cell / CELL_FILE).exists():
        return results / cell
    there = next(folder for folder in (cell, *cell.parents) if (results / folder).is_dir())
    choices = sorted(entry.name for entry in (results / there).iterdir() if entry.is_dir())
    listed = ", ".join(choices[:MOST_CHOICES]) + (", ..." if len(choices) > MOST_CHOICES else "")
    raise UserError(
        f"'{on_one_line(str(name / cell))}' is not a cell; {on_one_line(str(name / there))} has: {on_one_line(listed)}"
    )
