"""The package that CONTRIBUTING.md writes out: its files, and the commands that follow them."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parent.parent / "CONTRIBUTING.md"
FILE = re.compile(r"^`([\w./]+)`:\n\n```\w+\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMMANDS = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)


def files() -> dict[str, str]:
    """Return path -> text of every file that the page writes out: a line with its path, then its content."""
    return dict(FILE.findall(PAGE.read_text(encoding="utf-8")))


def commands() -> list[str]:
    """Return the blocks of commands that the page gives, each of one or several lines."""
    return list(COMMANDS.findall(PAGE.read_text(encoding="utf-8")))
