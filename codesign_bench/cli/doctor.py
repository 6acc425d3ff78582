"""`codesign-bench doctor`: print what a bug report needs."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.console import printer
from codesign_bench.visible_text import on_one_line

HELP = "print what a bug report needs: versions, processor, threads, and what is missing for which task"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add nothing: `doctor` takes no arguments."""


def run(options: argparse.Namespace, console: Console) -> int:
    """Print it."""
    del options
    from codesign_bench.doctor import diagnosis

    log = printer(console)
    for heading, section in diagnosis().items():
        log(heading)
        width = max(map(len, section), default=0)
        for name, value in section.items():
            log(f"  {name:{width}}  {on_one_line(value)}")
    return 0
