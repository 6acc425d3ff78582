"""Tables of a results folder: written the same on every system, read strictly.

A table is read whole or not at all: what we wrote ends in a line end, has each column once, the same number of fields
in each line, finite numbers where numbers belong, and each row once. Anything else is damaged.
"""

from __future__ import annotations

import csv
import fnmatch
import hashlib
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from codesign_bench.storage.files import Outputs, encoded
from codesign_bench.storage.json_fields import LARGEST_WHOLE, MOST_CHARACTERS
from codesign_bench.storage.layout import open_folder
from codesign_bench.storage.reading import MEGABYTE, DamagedFile, read_bytes

if TYPE_CHECKING:
    import pandas as pd

Booleans: TypeAlias = NDArray[np.bool_]

TABLE_BYTES = 16 * MEGABYTE
"""Largest table; the largest that we write has hundreds of kilobytes."""
MOST_COLUMNS = 4096
LARGEST = 1e15
"""Largest size of a number: what is measured is far smaller, and figures can still be drawn."""
NUMBERS = "biuf"
"""Kinds of numpy's types: truth values, integers with and without sign, floats."""
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


class Content(Enum):
    """What a column holds."""

    WHOLE = "integers from 0"
    NUMBER = "finite numbers"
    SHARE = "numbers from 0 to 1"
    TEXT = "texts"


@dataclass(frozen=True)
class Form:
    """What a table must have."""

    columns: Mapping[str, Content]
    """Name of a column that must be there, or a pattern with `*` of any number of columns -> what they hold."""
    unique: tuple[str, ...] = ()
    """Columns that tell every row from the others."""
    alike: tuple[str, ...] = ()
    """Groups of rows by these columns have equally many rows, for each value of the first of several columns."""
    rising: str | None = None
    """A column whose values rise from row to row."""


ANY_FORM = Form({})


@dataclass(frozen=True)
class Measurements:
    """A kind of tables beside the cells."""

    pattern: str
    """Of their paths below the results folder."""
    form: Form = field(default=ANY_FORM)


def csv_bytes(table: pd.DataFrame) -> bytes:
    """Return a table as the content of a CSV file, the same on every system."""
    return encoded(table.to_csv(index=False, lineterminator="\n"))


def checksum(content: bytes) -> str:
    """Return the checksum of a table that a finished cell records."""
    return hashlib.sha256(content).hexdigest()


def read_table(path: Path, form: Form = ANY_FORM, expected: str | None = None) -> pd.DataFrame | None:
    """Return the table in `path`, or None if there is none; `expected` is its checksum, if it is known.

    Raises:
        UnusableFile: it cannot be read, or is not a table of this form.
    """
    try:
        content = read_bytes(path, TABLE_BYTES)
    except FileNotFoundError:
        return None
    try:
        if expected is not None and checksum(content) != expected:
            raise ValueError("its checksum does not match")
        return parse_table(content, form)
    except (ValueError, csv.Error, OverflowError) as error:
        raise DamagedFile(path, " ".join(str(error).split())) from error


def parse_table(content: bytes, form: Form) -> pd.DataFrame:
    """Return the table in the content of a CSV file.

    Raises:
        ValueError, csv.Error, OverflowError: it is not a table of this form.
    """
    import pandas as pd  # imported here because it takes a second, which `--help` need not pay
    from packaging.version import Version

    _check_lines(content)
    # Numbers keep their last digit: by default since pandas 3.1, before only if that is asked for.
    exact: Any = {} if Version(pd.__version__) >= Version("3.1") else {"float_precision": "round_trip"}
    table = pd.read_csv(io.BytesIO(content), encoding="utf-8", low_memory=False, **exact)
    for name, kind in form.columns.items():
        for column in _matching(table, name):
            _check_column(table[column], kind)
    _check_rows(table, form)
    return table


def write_table(results: Path, path: Path, table: pd.DataFrame) -> None:
    """Replace the table in `path`, below the results folder `results`.

    Raises:
        UserError: the folder is not writable, or contains other files than results.
    """
    write_tables(results, {path: table})


def write_tables(results: Path, tables: Mapping[Path, pd.DataFrame]) -> None:
    """Replace the tables in these paths below the results folder `results`, all of them or none.

    Raises:
        UserError: the folder is not writable, or contains other files than results.
    """
    open_folder(results)
    with Outputs(str(results)) as outputs:
        for path, table in tables.items():
            outputs.write(path, csv_bytes(table))


def _check_lines(content: bytes) -> None:
    """Check what is wrong with a file whatever its columns are."""
    if not content:
        raise ValueError("empty")
    if content.startswith(BYTE_ORDER_MARK):
        raise ValueError("it begins with a byte order mark, so another program wrote it")
    if b"\0" in content:
        raise ValueError("it has a NUL byte")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"not UTF-8 at byte {error.start}") from error
    if not text.endswith("\n"):
        raise ValueError("truncated: its last line has no end")
    _check_fields(csv.reader(io.StringIO(text, newline=""), strict=True))


def _check_fields(lines: Iterable[list[str]]) -> None:
    rows = iter(lines)
    header = next(rows)
    if len(header) > MOST_COLUMNS:
        raise ValueError(f"it has {len(header)} columns")
    if len(set(header)) != len(header):
        raise ValueError(f"the column '{next(name for name in header if header.count(name) > 1)}' is there twice")
    count = 0
    for count, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise ValueError(f"row {count} has {len(row)} fields, not {len(header)}")
    if count == 0:
        raise ValueError("it has no rows")


def _matching(table: pd.DataFrame, name: str) -> list[str]:
    """Return the columns of a name, or of a pattern, which may match none.

    Raises:
        ValueError: there is no column of this name.
    """
    if "*" in name:
        return fnmatch.filter(table.columns, name)
    if name not in table.columns:
        raise ValueError(f"it lacks the column '{name}'")
    return [name]


def _check_column(column: pd.Series[float], kind: Content) -> None:
    """Check that a column holds what it should.

    Raises:
        ValueError: names the column and the first row that is otherwise; rows count from 1.
    """
    fits = _texts(column) if kind is Content.TEXT else _numbers(column, kind)
    if not fits.all():
        row = int(fits.argmin())
        value = column.iloc[row]
        told = "nothing" if value != value else f"'{str(value)[:40]}'"
        raise ValueError(f"row {row + 1} has {told} in the column '{column.name}', which holds {kind.value}")


def _texts(column: pd.Series[float]) -> Booleans:
    """Return which values are texts; a column of digits was read as numbers."""
    if column.dtype.kind in NUMBERS:
        return np.asarray(column.notna())
    return np.array([isinstance(value, str) and len(value) <= MOST_CHARACTERS for value in column])


def _numbers(column: pd.Series[float], kind: Content) -> Booleans:
    """Return which values are numbers of a kind; True and False are 1 and 0."""
    if column.dtype.kind not in NUMBERS:  # at least one is none
        return np.array(
            [isinstance(value, int | float) and isfinite(value) and abs(value) < LARGEST for value in column]
        )
    values = column.to_numpy(dtype=np.float64)
    with np.errstate(invalid="ignore"):
        if kind is Content.WHOLE:
            fits = (values == np.floor(values)) & (values >= 0) & (values <= LARGEST_WHOLE)
        else:
            fits = (values >= 0) & (values <= 1) if kind is Content.SHARE else np.abs(values) <= LARGEST
    return np.asarray(fits & np.isfinite(values))


def _check_rows(table: pd.DataFrame, form: Form) -> None:
    if form.unique and table.duplicated(list(form.unique)).any():
        row = int(table.duplicated(list(form.unique)).to_numpy().argmax()) + 1
        raise ValueError(f"row {row} repeats {', '.join(form.unique)} of an earlier row")
    if form.rising is not None and not (table[form.rising].diff().iloc[1:] > 0).all():
        raise ValueError(f"'{form.rising}' does not rise from row to row")
    if form.alike:
        counts = table.groupby(list(form.alike)).size()
        groups = counts.groupby(level=0).nunique() if len(form.alike) > 1 else [counts.nunique()]
        if max(groups) > 1:
            raise ValueError(f"rows are missing: groups of the same {', '.join(form.alike)} have different sizes")
