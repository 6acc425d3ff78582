"""The program's entry point. Exit codes: 0 success, 1 a cell failed, 2 bad input, 130 interrupted."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console

from codesign_bench import __version__
from codesign_bench.cli.arguments import module_name
from codesign_bench.cli.completion import answer_shell
from codesign_bench.console import json_lines, steady_streams
from codesign_bench.errors import UserError
from codesign_bench.plugins import import_modules
from codesign_bench.processes import children_with_safe_modules, existing_folder
from codesign_bench.startup import (
    EXIT_INTERRUPTED,
    PROGRAM,
    end_quietly_on_interrupt,
    is_program,
    raise_on_interrupt,
)
from codesign_bench.visible_text import visible

EXIT_BAD_INPUT = 2
LONGEST_LINE = 1_000
"""Characters; a longer line of a message loses its middle."""
COMMANDS = (
    "list",
    "show",
    "check",
    "run",
    "rerun",
    "tune",
    "status",
    "plot",
    "verify",
    "report",
    "compare",
    "pack",
    "explore",
    "reproduce",
    "reference",
    "headroom",
    "render",
    "deploy",
    "export",
    "bench",
    "doctor",
    "completion",
)
"""The modules of the commands, in the order of `--help`; each defines HELP, `add_arguments` and `run`."""


class _Parser(argparse.ArgumentParser):
    """An argument parser that reports bad input in two lines."""

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        # argparse drops `--` even where it is all that an option is given, as in `--jobs=--`.
        if action.option_strings and arg_strings and set(arg_strings) == {"--"}:
            raise argparse.ArgumentError(action, "expected a value, not '--'")
        return super()._get_values(action, arg_strings)

    def error(self, message: str) -> NoReturn:
        told = in_few_lines(" ".join(message.split()) or "bad input")
        print(f"{self.prog}: {told}\nsee: {self.prog} --help", file=sys.stderr)
        raise SystemExit(EXIT_BAD_INPUT)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    with children_with_safe_modules(), steady_streams(PROGRAM):
        try:
            return _run(arguments)
        except KeyboardInterrupt:
            print("\ninterrupted; the same command resumes", file=sys.stderr)
            return EXIT_INTERRUPTED
        finally:
            if is_program():
                end_quietly_on_interrupt()


def _run(arguments: Sequence[str] | None) -> int:
    answer_shell(build_parser)
    try:
        options = build_parser().parse_args(arguments)
    except SystemExit as stop:  # --help, --version and bad input
        return stop.code if isinstance(stop.code, int) else EXIT_BAD_INPUT
    try:
        _leave_deleted_folder(options)
        import_modules(options.imports)
        raise_on_interrupt()  # from here on there may be something to save
        with json_lines() if getattr(options, "json", False) else nullcontext(_plain_or_terminal()) as console:
            return int(options.command(options, console))
    except UserError as error:
        print(f"{PROGRAM}: {in_few_lines(str(error))}", file=sys.stderr)
        return EXIT_BAD_INPUT


def _leave_deleted_folder(options: argparse.Namespace) -> None:
    """Go to the root if the working folder was deleted, for libraries do not work without one.

    Raises:
        UserError: it was, and a path is given relative to it.
    """
    if (root := existing_folder()) is not None:
        for name, value in vars(options).items():
            if isinstance(value, Path) and not value.is_absolute():
                raise UserError(f"the working folder was deleted: give --{name} as an absolute path, not {value}")
        os.chdir(root)


def in_few_lines(text: str) -> str:
    """Return a message of at most two lines without control characters, whatever a user's words in it contain."""
    first, *others = visible(text.replace("\t", " ")).splitlines()
    lines = [first, " ".join(others)] if others else [first]
    half = LONGEST_LINE // 2
    return "\n".join(line if len(line) <= LONGEST_LINE else f"{line[:half]} ... {line[-half:]}" for line in lines)


def build_parser() -> argparse.ArgumentParser:
    """Return the parser for all commands."""
    parser = _Parser(
        prog=PROGRAM, description="Benchmark methods that learn a tool's design together with its control."
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for name in COMMANDS:
        module = import_module(f"codesign_bench.cli.{name}")
        command = commands.add_parser(name, help=module.HELP, description=module.HELP, allow_abbrev=False)
        command.set_defaults(command=module.run)
        command.add_argument(
            "--import",
            dest="imports",
            type=module_name,
            metavar="MODULE",
            action="append",
            default=[],
            help="import a module that defines tasks, methods, figures or a study; may be repeated",
        )
        module.add_arguments(command)
    return parser


def _plain_or_terminal() -> Console:
    """Return a console that draws on a terminal alone.

    FORCE_COLOR, which notebooks set, would make rich draw its moving table into a pipe or a file, too.
    """
    return Console() if sys.stdout.isatty() else Console(force_terminal=False)
