"""Pieces of Markdown that several pages are made of."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable


def toctree(entries: Iterable[str]) -> str:
    """Return a hidden table of contents; it gives the sidebar its order."""
    return "\n```{toctree}\n:hidden:\n\n" + "\n".join(entries) + "\n```\n"


def table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    lines = [list(header), *(list(row) for row in rows)]
    text = [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines]
    return "\n".join([text[0], "|" + " --- |" * len(lines[0]), *text[1:]])


def plain(text: str) -> str:
    """Return a text that can be an alternative text in Markdown."""
    return re.sub(r"[`\[\]*_]", lambda found: "" if found[0] != "_" else "_", text)


def first_sentence(text: str) -> str:
    """Return the first sentence of a docstring, on one line."""
    line = " ".join(inspect.cleandoc(text).split("\n\n")[0].split())
    return re.split(r"(?<=[a-z0-9)\]\"]\.)(?<!et al\.)\s", line, maxsplit=1)[0]


def lowered(sentence: str) -> str:
    """Return a sentence that goes on after a colon."""
    return sentence[0].lower() + sentence[1:]
