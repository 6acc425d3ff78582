"""Tables as text: Markdown for web pages, LaTeX for papers."""

from __future__ import annotations

import re
from collections.abc import Sequence

from codesign_bench.visible_text import on_one_line

COLUMN_END = re.compile(r"(?<!\\)\|")
"""A bar between cells; one inside a cell is escaped."""

LATEX_SPECIAL = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


TAG_OR_ENTITY = re.compile(r"<(?=[A-Za-z/!?])|&(?=#?\w+;)")
"""What Markdown would take for HTML."""
HTML = {"<": "&lt;", "&": "&amp;"}


def plain_markdown(text: str) -> str:
    """Return text on one line of Markdown without HTML, pictures and links."""
    shown = TAG_OR_ENTITY.sub(lambda found: HTML[found[0]], on_one_line(text))
    return shown.replace("](", "]\\(")


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    shown = ([plain_markdown(text).replace("|", "\\|") for text in line] for line in lines)
    return "\n".join("| " + " | ".join(line) + " |" for line in shown) + "\n"


def read_markdown(text: str) -> tuple[list[str], list[list[str]]] | None:
    """Return header and rows of a table that `markdown` wrote, or None if `text` is not exactly one such table."""
    lines = text.strip().splitlines()
    if len(lines) < 2 or not all(line.startswith("| ") and line.endswith(" |") for line in lines):
        return None
    header, rule, *rows = ([_read(cell) for cell in COLUMN_END.split(line)[1:-1]] for line in lines)
    if set(rule) != {"---"} or any(len(row) != len(header) for row in rows):
        return None
    return header, rows


def _read(cell: str) -> str:
    shown = cell.strip().replace("\\|", "|").replace("]\\(", "](")
    return shown.replace(HTML["<"], "<").replace(HTML["&"], "&")


def latex(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a LaTeX tabular with booktabs rules; columns of numbers are aligned right, others left."""
    columns = "".join("r" if is_number(cell) else "l" for cell in (rows[0] if rows else header))
    body = [" & ".join(_escaped(text) for text in line) + r" \\" for line in (header, *rows)]
    lines = [rf"\begin{{tabular}}{{{columns}}}", r"\toprule", body[0], r"\midrule", *body[1:], r"\bottomrule"]
    return "\n".join([*lines, r"\end{tabular}"]) + "\n"


def _escaped(text: str) -> str:
    return "".join(LATEX_SPECIAL.get(character, character) for character in on_one_line(text))


def is_number(text: str) -> bool:
    """Return whether a cell is a number, or the dash that stands for a missing one."""
    return text.replace(",", "").replace(".", "").replace("-", "").isdigit() or text == "-"
