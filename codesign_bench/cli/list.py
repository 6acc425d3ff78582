"""`codesign-bench list`: names of methods, tasks, figures, studies and profiles; imports no method and no task."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.config.profiles import profiles
from codesign_bench.console import printer
from codesign_bench.errors import UserError
from codesign_bench.registry import names
from codesign_bench.study import DEFAULT_STUDY, load_study, study_names

HELP = "list methods, tasks, figures, studies and profiles"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add nothing: `list` takes no arguments."""


def run(options: argparse.Namespace, console: Console) -> int:
    """Print the names."""
    del options
    log, of_study = printer(console), load_study(DEFAULT_STUDY).methods
    beyond = [name for name in names("methods") if name not in of_study]
    for title, members in (("methods", of_study), ("methods beyond", beyond)):
        for line in [title, *(f"  {name}" for name in members)] if members else []:
            log(line)
    for title, group in (("tasks", "tasks"), ("figures", "paper_figs")):
        log(title)
        for name in names(group):
            log(f"  {name}")
    for title, entries in (
        ("studies", [(name, _title(name)) for name in study_names()]),
        ("profiles", [(profile.name, profile.help) for profile in profiles().values()]),
    ):
        log(title)
        for name, text in entries:
            log(f"  {name:8} {text}")
    return 0


def _title(study: str) -> str:
    """Return the title of a study, or why it cannot be imported."""
    try:
        return load_study(study).title
    except UserError as error:
        return str(error)
