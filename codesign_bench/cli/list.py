"""`codesign-bench list`: names of methods, tasks, figures and profiles; imports none of them."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.config.profiles import PROFILE_HELP
from codesign_bench.console import printer
from codesign_bench.registry import names

HELP = "names of methods, tasks, figures and profiles"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add nothing: `list` has no arguments of its own."""


def run(options: argparse.Namespace, console: Console) -> int:
    """Print the names."""
    del options
    log = printer(console)
    for title, group in (("methods", "methods"), ("tasks", "tasks"), ("figures", "paper_figs")):
        log(title)
        for name in names(group):
            log(f"  {name}")
    log("profiles")
    for name, text in PROFILE_HELP.items():
        log(f"  {name:8} {text}")
    return 0
