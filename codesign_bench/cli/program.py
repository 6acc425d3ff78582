"""The program's entry point. Exit codes: 0 success, 1 a cell failed, 2 bad input, 130 interrupted."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from rich.console import Console

from codesign_bench import __version__
from codesign_bench.errors import UserError
from codesign_bench.plugins import import_modules
from codesign_bench.visible_text import visible

PROGRAM = "codesign-bench"
EXIT_BAD_INPUT, EXIT_INTERRUPTED = 2, 130
COMMANDS = (
    "list",
    "show",
    "run",
    "tune",
    "status",
    "plot",
    "verify",
    "report",
    "reproduce",
    "reference",
    "render",
    "deploy",
    "export",
    "bench",
)
"""The modules of the commands, in the order of `--help`; each defines HELP, `add_arguments` and `run`."""


class _Parser(argparse.ArgumentParser):
    """An argument parser that reports bad input in two lines."""

    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {visible(' '.join(message.split()))}\nsee: {self.prog} --help", file=sys.stderr)
        raise SystemExit(EXIT_BAD_INPUT)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    try:
        options = build_parser().parse_args(arguments)
    except SystemExit as stop:  # --help, --version and bad input
        return stop.code if isinstance(stop.code, int) else EXIT_BAD_INPUT
    console = Console()
    try:
        _extend_path(options.imports)
        import_modules(options.imports)
        return int(options.command(options, console))
    except UserError as error:
        print(visible(f"{PROGRAM}: {error}"), file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("\ninterrupted; the same command resumes", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of the output, e.g. `head`, has closed the pipe
        sys.stderr.close()
        return 0


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
            metavar="MODULE",
            action="append",
            default=[],
            help="import a module that defines tasks, methods, figures or a study; may be repeated",
        )
        module.add_arguments(command)
    return parser


def _extend_path(imports: Sequence[str]) -> None:
    """Make `--import` find modules in the working folder, as `python -m` does."""
    if imports and "" not in sys.path:
        sys.path.insert(0, "")
