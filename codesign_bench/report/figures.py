"""Figures as parts of the page, with embedded pictures, numbers and texts, so that it needs no other file."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from pathlib import Path

from codesign_bench.console import Log
from codesign_bench.figures.drawing import Drawing, possible_drawings
from codesign_bench.storage.tables import csv_bytes
from codesign_bench.study.study import Study
from codesign_bench.text_tables import is_number, read_markdown

from .tables import Table

DOTS_PER_INCH = 220
SHOWN_PER_INCH = 135
"""CSS pixels per inch of a figure: its font size of 7 points is then that of the page's small text."""


@dataclass(frozen=True)
class FigurePart:
    """One figure on the page."""

    name: str
    title: str
    about: str
    picture: str
    """The picture as a data URI, and its size on the page in CSS pixels."""
    width: int
    height: int
    numbers: str
    """The figure's CSV file as a data URI."""
    table: Table | None
    """The figure as a table, if it has one."""
    texts: list[tuple[str, str]]
    """Ending and content of every other text of the figure."""


def figure_parts(results: Path, study: Study, log: Log) -> list[FigurePart]:
    """Return every figure of a study that can be drawn; `log` gets those that are left out, and why."""
    return [_part(drawing) for drawing in possible_drawings(results, log, study)]


def data_uri(kind: str, content: bytes) -> str:
    """Return `content` as a data URI."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _part(drawing: Drawing) -> FigurePart:
    picture = io.BytesIO()
    drawing.figure.savefig(picture, format="png", dpi=DOTS_PER_INCH)
    width, height = (round(SHOWN_PER_INCH * inches) for inches in drawing.figure.get_size_inches())
    shown = read_markdown(drawing.texts.get("md", ""))
    others = [(ending, text) for ending, text in drawing.texts.items() if ending != "md" or shown is None]
    return FigurePart(
        name=drawing.name,
        title=drawing.title,
        about=drawing.about,
        picture=data_uri("image/png", picture.getvalue()),
        width=width,
        height=height,
        numbers=data_uri("text/csv", csv_bytes(drawing.table)),
        table=None if shown is None else _table(*shown),
        texts=others,
    )


def _table(header: list[str], rows: list[list[str]]) -> Table:
    """Return a table with columns of numbers aligned to the right."""
    columns = zip(*rows, strict=True) if rows else [()] * len(header)
    numeric = {name for name, column in zip(header, columns, strict=True) if column and all(map(is_number, column))}
    return Table(tuple(header), [tuple(row) for row in rows], frozenset(numeric))
