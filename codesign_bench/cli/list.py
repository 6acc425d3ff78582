"""`codesign-bench list`: names of methods, tasks, figures, studies and profiles; imports no method and no task."""

from __future__ import annotations

import argparse

from rich.console import Console

from codesign_bench.cli.arguments import ALL, groups
from codesign_bench.config.profiles import profiles
from codesign_bench.console import printer
from codesign_bench.errors import UnavailableError
from codesign_bench.registry import built_in, names
from codesign_bench.source_code import SourceModule
from codesign_bench.study import load_study, study_names

TOOLS = {True: "a tool per goal", False: "one tool for all goals", None: ""}
"""`Method.tool_per_goal` -> its words; None: not known without an import."""
HELP = "list methods, tasks, figures, studies and profiles"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add nothing: `list` takes no arguments."""


def run(options: argparse.Namespace, console: Console) -> int:
    """Print the names."""
    del options
    log, width = printer(console), max(map(len, names("methods")))
    for word, members in groups("methods").items():
        if members:
            log(_heading("methods", word))
        tools = {name: _tools(name) for name in members}
        for words in TOOLS.values():
            for name in [name for name in members if tools[name] == words]:
                log(f"  {name:{width}} {words}".rstrip())
    of_tasks = [(_heading("tasks", word), members) for word, members in groups("tasks").items()]
    for title, listed in [*of_tasks, ("figures", names("paper_figs"))]:
        for line in [title, *(f"  {name}" for name in listed)] if listed else []:
            log(line)
    for title, entries in (
        ("studies", [(name, _title(name)) for name in study_names()]),
        ("profiles", [(profile.name, profile.help) for profile in profiles().values()]),
    ):
        log(title)
        width = max(len(name) for name, _ in entries)
        for name, text in entries:
            log(f"  {name:{width}} {text}")
    return 0


def _heading(kind: str, word: str) -> str:
    """Return the title above the members of a group, named as on the command line; `all` needs no word."""
    return kind if word == ALL else f"{kind} {word}"


def _tools(method: str) -> str:
    """Return for how many goals a built-in method's tools are; nothing for those of other packages."""
    if method not in built_in("methods"):
        return TOOLS[None]
    return TOOLS[SourceModule(f"codesign_bench.methods.{method}").stated("tool_per_goal") is not False]


def _title(study: str) -> str:
    """Return the title of a study, or why it cannot be used."""
    try:
        return load_study(study).title
    except UnavailableError as error:
        return f"not available: {error.reason}"
