"""`codesign-bench completion`: print what makes a shell complete commands, options and names of members."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Mapping

from rich.console import Console

from codesign_bench.cli.arguments import ALL, BEYOND
from codesign_bench.config.profiles import profiles
from codesign_bench.errors import UnavailableError
from codesign_bench.registry import names
from codesign_bench.startup import PROGRAM
from codesign_bench.study import DEFAULT_STUDY, load_study, study_names

HELP = "print shell code that completes commands, options, and names of tasks, methods and figures"
SHELLS = ("bash", "zsh", "fish")
ASKED = "_ARGCOMPLETE"
"""Environment variable that is set where a shell asks this program for completions."""
INSTALL = "pip install 'codesign-bench[completion]'"

CHOICES: Mapping[str, Callable[[], Iterable[str]]] = {
    "--task": lambda: (*names("tasks"), ALL),
    "--method": lambda: (*names("methods"), ALL, BEYOND),
    "--study": study_names,
    "--profile": lambda: profiles(),
    "figures": lambda: names("paper_figs"),
    "experiments": lambda: (*load_study(DEFAULT_STUDY).experiments, ALL),
}
"""Option, or name of an argument -> the names that it may be; looked up when a shell asks."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the shell."""
    parser.add_argument("shell", choices=SHELLS, help='in bash and zsh: eval "$(codesign-bench completion bash)"')


def run(options: argparse.Namespace, console: Console) -> int:
    """Print the code."""
    try:
        import argcomplete
    except ImportError as error:
        raise UnavailableError(f"completion needs argcomplete, which is not installed: {INSTALL}") from error
    del console  # the code must come as it is
    print(argcomplete.shellcode([PROGRAM], shell=options.shell))
    return 0


def answer_shell(make_parser: Callable[[], argparse.ArgumentParser]) -> None:
    """Answer a shell that asks for completions, and end; do nothing if none asks."""
    if ASKED not in os.environ:
        return
    import argcomplete  # a shell asks only after `run` has set it up

    parser = make_parser()
    with_choices(parser)
    argcomplete.autocomplete(parser)


def with_choices(parser: argparse.ArgumentParser) -> None:
    """Tell argcomplete the names that options of a parser and of the commands below it may be."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for child in action.choices.values():
                with_choices(child)
        for name in (*action.option_strings, action.dest):
            if name in CHOICES:
                # argcomplete looks for this attribute, which argparse does not declare.
                action.completer = _completer(CHOICES[name])  # type: ignore[attr-defined]


def _completer(choices: Callable[[], Iterable[str]]) -> Callable[..., list[str]]:
    def complete(prefix: str, **_: object) -> list[str]:
        return [name for name in choices() if name.startswith(prefix)]

    return complete
