"""Text that may come from another person's results folder, made harmless for where it is shown.

A label or an error in a cell file may hold anything: sequences that control a terminal, characters that reverse the
direction of a line, bytes of a path that are no text. Each medium calls its own function, at the one place where text
leaves for it: `visible` for the terminal and files of text, `on_one_line` for cells of tables, `in_figure` for figures.
"""

from __future__ import annotations

import unicodedata

SHOWN = ("\n", "\t")
"""Control characters that are layout."""
HARMFUL = ("Cc", "Cs", "Cf", "Zl", "Zp")
"""Unicode categories: control, half a character, format (which hides or reverses text), line and paragraph ends."""
MOST_IN_FIGURE = 80
"""Characters of a text in a figure."""


def visible(text: str) -> str:
    """Return text in which what would control a terminal is shown as an escape, e.g. `\\x1b`."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        _escape(character) if unicodedata.category(character) in HARMFUL and character not in SHOWN else character
        for character in text
    )


def on_one_line(text: str) -> str:
    """Return visible text without line ends and tabs."""
    return visible(" ".join(text.split("\n")).replace("\t", " "))


def in_figure(text: str) -> str:
    """Return text that matplotlib shows as it is: on one line, not too long, and never as a formula."""
    shown = on_one_line(text)
    shown = shown if len(shown) <= MOST_IN_FIGURE else shown[: MOST_IN_FIGURE - 3] + "..."
    return shown.replace("$", r"\$")


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
