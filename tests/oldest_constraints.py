"""Pins to the oldest releases that setup.cfg allows. As a script, it prints them, for `make test-oldest`."""

from __future__ import annotations

import configparser
import re
from pathlib import Path

SETUP = Path(__file__).resolve().parent.parent / "setup.cfg"
BOUND = re.compile(r"(?P<name>[\w.-]+) *>= *(?P<version>[\w.]+)(?P<marker> *;.*)?")


def requirements() -> list[str]:
    """Return every requirement of the package and of its extras, as setup.cfg has it."""
    setup = configparser.ConfigParser()
    setup.read(SETUP, encoding="utf-8")
    lists = [setup["options"]["install_requires"], *setup["options.extras_require"].values()]
    lines = [line for text in lists for line in text.strip().splitlines()]
    return list(dict.fromkeys(line for line in lines if not line.startswith("#")))


def constraints() -> list[str]:
    """Return a pin for each requirement with a lower bound."""
    bounds = [found for line in requirements() if (found := BOUND.fullmatch(line))]
    return [f"{bound['name']}=={bound['version']}{bound['marker'] or ''}" for bound in bounds]


if __name__ == "__main__":
    print("\n".join(constraints()))
