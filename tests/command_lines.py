"""Invalid command lines, made from the parsers and from the limits that settings declare; none is typed by hand.

By hand, all of them in processes of their own: python tests/command_lines.py [SHARE], with a share such as 0.1.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import typing
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from codesign_bench.cell.axes import BUILT_IN
from codesign_bench.cli.arguments import OfKind, module_name, out_file, out_folder, own_results, path
from codesign_bench.cli.program import build_parser
from codesign_bench.config.run_settings import RunSettings
from codesign_bench.config.validation import kinds_of
from codesign_bench.config.values import Length, Within
from codesign_bench.method import load_method

LONG = "x" * 5_000
NO_NUMBER = (
    "",
    " ",
    "x",
    "nan",
    "inf",
    "-inf",
    "1e400",
    "0x10",
    "1,5",
    "1_",
    "--",
    "\uff11",
    "\u0663",
    "9" * 5_000,
    "1\0",
)
NO_SEEDS = ("0", "-1", "1.5", "99999999", "0-99999999", "5-2", "1,", ",", "1-2-3", "1,,2", "4294967296-")
NO_PATH = ("", " ", "a\0b", LONG, "/".join(["y" * 200] * 40))
NO_MODULE = ("", " ", ".", "..", ".a", "a.", "a b", "a-b", "1a", "a/b", "a.py/", "a\0b", LONG)
REQUIRED = {
    "run": ("--method", "cma_es", "--task", "push"),
    "show": ("--method", "cma_es", "--task", "push"),
    "render": ("--task", "push", "--out", "new/push.png"),
    "deploy": ("--policy", "nowhere"),
    "export": ("--policy", "nowhere", "--out", "new"),
    "reference": ("--task", "push"),
    "headroom": ("--update",),
    "compare": ("nowhere", "elsewhere"),
    "pack": ("nowhere", "--out", "new.zip"),
    "bench sweep": ("--task", "push", "--method", "cma_es"),
}
"""What each command needs before anything else can be wrong; others need nothing."""
RUN = ("run", "--method", "gnn_ppo", "cma_rl", "cma_es", "--task", "push", "--out", "new/runs", "--set")


@dataclass(frozen=True)
class Line:
    """A command line that must be refused."""

    words: tuple[str, ...]
    named: str
    """What the message must contain."""

    @property
    def fits_a_process(self) -> bool:
        """Whether a process can be started with it: no zero byte, and no half of a character."""
        return not any("\0" in word or len(word) > 100_000 for word in self.words)


def outside(kind: Any) -> Iterator[str]:
    """Yield texts that are no value of a kind: beyond each of its limits, and of no such form."""
    base, *limits = typing.get_args(kind) if typing.get_origin(kind) is typing.Annotated else (kind,)
    origin = typing.get_origin(base)
    for limit in limits:
        if isinstance(limit, Within):
            yield from (f"{limit.low - 1:.17g}", f"{limit.high * 2 + 1:.17g}", "-1e300", "1e300")
            yield from [f"{limit.low:.17g}"] * limit.open_low + [f"{limit.high:.17g}"] * limit.open_high
        if isinstance(limit, Length):
            yield from [""] * (limit.low > 0) + [",".join(["1"] * (limit.high + 1))]
    if base in (int, float):
        yield from NO_NUMBER
        yield from ["1.5"] if base is int else []
    elif origin is tuple:
        yield from (f"1,{text}" for text in outside(typing.get_args(base)[0]) if "," not in text and text.strip())
    elif origin is typing.Literal or base is bool:
        yield from ("", "x", "none", "2", LONG)
    elif type(None) in typing.get_args(base):
        yield from (text for choice in typing.get_args(base) if choice is not type(None) for text in outside(choice))


def invalid_values(action: argparse.Action) -> Iterator[str]:
    """Yield values that an option or argument must refuse by itself."""
    if action.choices is not None:
        yield from ("", "x", "CPU", LONG)
    elif isinstance(action.type, OfKind):
        yield from outside(action.type.kind)
    elif action.type in (path, out_folder, out_file, own_results):
        yield from NO_PATH
        yield from [] if action.type is path else ["/dev/null/new", "/dev/null/new/file.png"]
    elif action.type is module_name:
        yield from NO_MODULE


def commands() -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """Yield the words of every command with its parser."""
    for words, parser in _below((), build_parser()):
        if words and not _choices(parser):
            yield words, parser


def _below(words: tuple[str, ...], parser: argparse.ArgumentParser) -> Iterator[tuple[tuple[str, ...], Any]]:
    yield words, parser
    for name, child in _choices(parser).items():
        yield from _below((*words, name), child)


def _choices(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    found = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def of_options() -> Iterator[Line]:
    """Yield every option of every command with every kind of value that it must refuse, and without any."""
    for words, parser in commands():
        needed = REQUIRED.get(" ".join(words), ())
        for action in parser._actions:
            if action.option_strings and action.nargs != 0:
                (option, *_) = action.option_strings
                yield Line((*words, *needed, option), option)
                for value in invalid_values(action):
                    yield Line((*words, *needed, f"{option}={value}"), option)
            elif action.option_strings and not isinstance(action, argparse._HelpAction):
                (option, *_) = action.option_strings
                yield Line((*words, *needed, f"{option}=1"), option)
        yield Line((*words, *needed, "--no-such-option"), "no-such-option")
        yield Line((*words, *needed, "--no-such-option=1"), "no-such-option")
        yield Line((*words, *needed, "--import", "no_such_module"), "no_such_module")


def of_names() -> Iterator[Line]:
    """Yield names of members that there are not, for every option that takes one."""
    meant = {"--task": "task", "--method": "method", "--study": "study", "--profile": "profile", "--only": "learner"}
    for words, parser in commands():
        needed = REQUIRED.get(" ".join(words), ())
        for action in parser._actions:
            for option in set(action.option_strings) & set(meant):
                for name in ("no_such_name", "PUSH", "push/..", "\x1b[2J", LONG):
                    if words[0] not in ("compare", "deploy", "export") and not (
                        option == "--profile" and words[0] == "tune"
                    ):
                        yield Line((*words, *needed, option, name), meant[option])


def of_settings() -> Iterator[Line]:
    """Yield every setting of the run and of three methods with values that it must refuse."""
    kinds = {name: kind for method in ("gnn_ppo", "cma_rl", "cma_es") for name, kind in _kinds(method).items()}
    for name, kind in (kinds_of(RunSettings) | kinds).items():
        for value in dict.fromkeys(outside(kind)):
            yield Line((*RUN, f"{name}={value}"), name)
        yield Line((*RUN, f"{name}"), name)
        yield Line((*RUN, f"{name.upper()}=1"), name.upper())
        yield Line((*RUN, f"no_such_method.{name}=1"), "no_such_method")
        yield Line((*RUN, f"{name}=1", f"{name}=1"), name)


def _kinds(method: str) -> dict[str, Any]:
    return kinds_of(load_method(method).config_class)


def of_axes() -> Iterator[Line]:
    """Yield axes with values that they must refuse, in both forms, and texts that are no seeds."""
    start = (*RUN[:-1],)
    for name, axis in BUILT_IN.items():
        for value in outside(axis.kind):
            if "," not in value:
                yield Line((*start, "--variant", f"{name}={value}"), "--variant")
    for text in ("", "=", "x", "=1", "no_such_axis=1", "alpha", "alpha="):
        yield Line((*start, "--variant", text), "axis" if "no_such" in text else "--variant")
    for seeds in (*[text for text in NO_NUMBER if "," not in text], *NO_SEEDS):
        yield Line((*start, f"--seeds={seeds}"), "--seeds")


def invalid_lines() -> list[Line]:
    """Return all of them, each once."""
    return list(dict.fromkeys([*of_options(), *of_names(), *of_settings(), *of_axes()]))


def faults(line: Line, code: int, errors: str, left: Iterable[str]) -> list[str]:
    """Return what is wrong with the answer to a command line."""
    lines, found = errors.strip().splitlines(), []
    found += [f"exit code {code}"] if code != 2 else []
    found += [f"{len(lines)} lines"] if not 1 <= len(lines) <= 3 else []
    found += ["a traceback"] if "Traceback" in errors else []
    found += [f"does not name {line.named}"] if line.named not in errors else []
    found += [f"left {name}" for name in left]
    return found


def answered_by_a_process(line: Line) -> list[str]:
    """Return what is wrong with the answer that a process of its own gives."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "codesign_bench", *line.words]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", timeout=120)
        return faults(line, done.returncode, done.stderr, os.listdir(folder))


def sample(lines: Sequence[Line], share: float) -> list[Line]:
    """Return a random share of the lines that a process can be started with."""
    possible = [line for line in lines if line.fits_a_process]
    return random.Random(0).sample(possible, max(1, round(share * len(possible))))


def main() -> None:
    """Ask processes and print what is wrong."""
    chosen = sample(invalid_lines(), float(sys.argv[1]) if len(sys.argv) > 1 else 1.0)
    wrong = 0
    for line in chosen:
        if found := answered_by_a_process(line):
            wrong += 1
            print(" ".join(word[:60] for word in line.words), "->", "; ".join(found))
    print(f"{len(chosen) - wrong} of {len(chosen)} refused as they should be")


if __name__ == "__main__":
    main()
