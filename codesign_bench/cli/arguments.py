"""Arguments that several commands share: folders, kinds of values and groups of names."""

from __future__ import annotations

import argparse
import errno
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.resolve import split_override
from codesign_bench.config.run_settings import Steps, Threads
from codesign_bench.config.values import parse_value, printable, shown
from codesign_bench.console import Log, printer, silent, tell
from codesign_bench.errors import UnavailableError, UserError, unknown_name
from codesign_bench.registry import KINDS, names, usable
from codesign_bench.storage.places import REFERENCE
from codesign_bench.study import DEFAULT_STUDY, load_study
from codesign_bench.visible_text import visible

if TYPE_CHECKING:
    from codesign_bench.evaluation.expected import Work

DEFAULT_RESULTS = Path("results/runs")
DEFAULT_FIGURES = Path("results/figures")
DEFAULT_CLAIMS = Path("results/claims")
DEFAULT_REPORT = Path("results/report.html")
ALL, BEYOND = "all", "beyond"
LONGEST_PATH, LONGEST_NAME = 3_000, 255
"""Bytes of a path and of a name in it; systems allow 4,096 and 255, and files below the path need some."""
Jobs = Threads
"""How many cells may run at a time: as many as there may be cores."""


def add_results(parser: argparse.ArgumentParser, check: Callable[[str], Path] | None = None) -> None:
    """Add `--results`, what a command reads; `check` is another parser, for a command that also writes there.

    `results_folder` finds what is given without another parser: a folder, an archive or the shipped results.
    """
    kinds = f", an archive of `pack`, or `{REFERENCE}`" if check is None else ""
    parser.add_argument(
        "--results",
        type=check or path,
        default=DEFAULT_RESULTS,
        metavar="DIR",
        help=f"results folder{kinds}; default: {DEFAULT_RESULTS}",
    )


def add_out(parser: argparse.ArgumentParser, default: Path, metavar: str = "DIR") -> None:
    """Add `--out`, the file or folder that a command writes."""
    kind, check = ("file", out_file) if metavar == "FILE" else ("folder", out_folder)
    parser.add_argument(
        "--out", type=check, default=default, metavar=metavar, help=f"output {kind}; default: {default}"
    )


def add_profile(parser: argparse.ArgumentParser) -> None:
    """Add `--profile`."""
    parser.add_argument(
        "--profile", default=DEFAULT_PROFILE, metavar="P", help=f"a name that `list` shows; default: {DEFAULT_PROFILE}"
    )


def add_study(parser: argparse.ArgumentParser) -> None:
    """Add `--study`, the source of a command's experiments, figures and claims."""
    parser.add_argument(
        "--study",
        default=DEFAULT_STUDY,
        metavar="NAME",
        help=f"source of experiments, figures and claims; default: {DEFAULT_STUDY}, the paper's study",
    )


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Add `--jobs`, the number of cells that run at a time."""
    parser.add_argument(
        "--jobs", type=OfKind(Jobs), metavar="N", help="cells that run at a time; default: one per core"
    )


def add_sweep(parser: argparse.ArgumentParser) -> None:
    """Add where cells run, and whether those that failed run again."""
    parser.add_argument(
        "--backend", default="loky", choices=("loky", "dask"), help="loky (default): this machine; dask: a cluster"
    )
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of a running Dask scheduler (default: start a local cluster)"
    )
    parser.add_argument("--retry-failed", action="store_true", help="run failed cells again")


def add_same_code(parser: argparse.ArgumentParser) -> None:
    """Add whether cells count that were run with other code of their task or method."""
    parser.add_argument(
        "--same-code",
        action="store_true",
        help="count and resume cells although the code of their task or method was changed since",
    )


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add whether progress and results are printed for programs."""
    parser.add_argument(
        "--json", action="store_true", help="print lines of JSON, one event each, for programs that follow the command"
    )


def add_tensorboard(parser: argparse.ArgumentParser) -> None:
    """Add whether curves and metrics are also written for TensorBoard."""
    parser.add_argument(
        "--tensorboard",
        action="store_true",
        help="also write curves and metrics as TensorBoard scalars, live: tensorboard --logdir DIR",
    )


def add_dry_run(parser: argparse.ArgumentParser, what: str) -> None:
    """Add whether a command only says what it would do: `what`."""
    parser.add_argument("--dry-run", action="store_true", help=f"run nothing: {what}")


def tell_work(console: Console, what: str, work: Work) -> None:
    """Say what would be played: on which task, or for which cell."""
    values = {"episodes": work.episodes, "steps": work.env_steps, "expected_seconds": work.seconds}
    if not tell(console, "plan", of=what, **values):
        printer(console)(f"{what}: {work.line() if work.episodes else 'nothing to play'}")


def add_config(parser: argparse.ArgumentParser) -> None:
    """Add what determines a cell's configuration: profile, budget and individual settings."""
    add_profile(parser)
    parser.add_argument(
        "--steps", type=OfKind(Steps), metavar="N", help="budget in environment steps (default: the profile's)"
    )
    parser.add_argument(
        "--set",
        dest="overrides",
        nargs="+",
        action="extend",
        default=[],
        metavar="KEY=VALUE",
        help="override a run setting or a hyperparameter; METHOD.KEY=VALUE for one method",
    )


class OfKind:
    """Parses an option's value as a kind of values: see `config.values`."""

    def __init__(self, kind: Any) -> None:
        self.kind = kind

    def __call__(self, text: str) -> Any:
        """Return the value of `text`.

        Raises:
            ArgumentTypeError: it is not of this kind.
        """
        try:
            return parse_value(self.kind, text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"expected {error}, not {shown(text)}") from None


def path(text: str) -> Path:
    """Return a path that the system can hold, with room for the names of what is written below it.

    Raises:
        ArgumentTypeError: it is empty, or contains what no path can.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError("expected a path, not an empty text")
    if "\0" in text:
        raise argparse.ArgumentTypeError(f"expected a path, which cannot contain a zero byte, not {shown(text)}")
    if len(os.fsencode(text)) > LONGEST_PATH or any(len(os.fsencode(part)) > LONGEST_NAME for part in Path(text).parts):
        raise argparse.ArgumentTypeError(f"expected a shorter path than {shown(text)}")
    return Path(text)


def out_folder(text: str) -> Path:
    """Return the path of a folder that can be written or made, as far as can be checked without doing it.

    Raises:
        ArgumentTypeError: it cannot; nobody should learn that after hours.
    """
    chosen = path(text)
    _check_writable(chosen, text)
    return chosen


def own_results(text: str) -> Path:
    """Return the path of a results folder that is also written.

    Raises:
        ArgumentTypeError: it cannot be, or is the name of the shipped results.
    """
    chosen = out_folder(text)
    if chosen == Path(REFERENCE) and not chosen.exists():
        raise argparse.ArgumentTypeError(f"'{REFERENCE}' names the shipped results, which are only read; give a folder")
    return chosen


def out_file(text: str) -> Path:
    """Return the path of a file that can be written, as far as can be checked without doing it.

    Raises:
        ArgumentTypeError: it cannot.
    """
    chosen = path(text)
    _check_writable(chosen.parent, text)
    if chosen.is_dir():
        raise argparse.ArgumentTypeError(f"{visible(text)}: is a folder; give a file in it")
    return chosen


def _check_writable(folder: Path, text: str) -> None:
    """Check that a folder can be written or made; `text` is what the user gave.

    Raises:
        ArgumentTypeError: it cannot.
    """
    try:
        existing = next(part for part in (folder, *folder.parents) if part.exists() or part.is_symlink())
        fault = 0 if os.access(existing, os.W_OK | os.X_OK) else errno.EACCES
        fault = fault if existing.is_dir() else errno.ENOTDIR
    except OSError as error:
        fault = error.errno or errno.EACCES
    if fault:
        raise argparse.ArgumentTypeError(f"{visible(text)}: not writable ({os.strerror(fault)})")


def module_name(text: str) -> str:
    """Return the dotted name of a module.

    Raises:
        ArgumentTypeError: no module can have this name.
    """
    if len(text) > LONGEST_NAME or not all(part.isidentifier() for part in text.split(".")):
        raise argparse.ArgumentTypeError(
            f"expected the dotted name of a module, such as my_package.my_task, not {shown(text)}"
        )
    return text


def check_once(overrides: Sequence[str], **options: object) -> None:
    """Check that no setting is given twice, by `--set` or by one of `options`, which name the settings that they set.

    Raises:
        UserError: one is; names it.
    """
    given = [name for name, value in options.items() if value is not None]
    seen: set[str] = set()
    for text in overrides:
        prefix, key, _ = split_override(text)
        name = key if prefix is None else f"{prefix}.{key}"
        if name in seen:
            raise UserError(f"--set {printable(text)}: {shown(name)} is given twice")
        if key in given:
            raise UserError(f"--set {printable(text)}: --{key} gives it, too; leave out one of them")
        seen.add(name)


def chosen_names(group: str, given: Sequence[str], meanings: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the names that an argument selects, in the given order.

    Args:
        group: one of `registry.KINDS`.
        given: words of the command line; each may contain several names, separated by commas.
        meanings: words that stand for several names, e.g. `all`.

    Raises:
        UserError: an unknown name, or no name at all.
    """
    chosen = list(dict.fromkeys(name for word in _words(given) for name in meanings.get(word, (word,))))
    known, kind = names(group), KINDS[group]
    for name in chosen:
        if name not in known:
            raise unknown_name(kind, name, (*known, *meanings))
    if not chosen:
        raise UserError(f"--{kind}: no name given; choose from: {', '.join((*known, *meanings))}")
    return chosen


def groups(group: str) -> dict[str, tuple[str, ...]]:
    """Return what `all` and `beyond` stand for in `group`, "methods" or "tasks"."""
    study = load_study(DEFAULT_STUDY)
    of_study = {"methods": study.methods, "tasks": study.tasks}[group]
    return {ALL: of_study, BEYOND: tuple(name for name in names(group) if name not in of_study)}


def chosen_tasks(given: Sequence[str], log: Log = silent, sound: bool = True) -> list[str]:
    """Return the tasks that `--task` selects: `all` is those of the default study, `beyond` all others.

    What cannot be used in this Python is no part of `all`, and `log` names it; by its own name, it is refused.

    Args:
        given: words of the command line.
        log: shows what is left out.
        sound: whether a task whose own code is at fault raises its error; it is selected otherwise.

    Raises:
        UserError: an unknown name, or no name at all.
        UnavailableError: a task of this name cannot be used in this Python, or no task at all can.
    """
    from codesign_bench.task import load_task

    chosen = chosen_names("tasks", given, groups("tasks"))
    return _without_unusable(chosen, _words(given), load_task if sound else _if_available(load_task), log)


def chosen_methods(given: Sequence[str], log: Log = silent, sound: bool = True) -> list[str]:
    """Return the methods that `--method` selects: `all` is those of the default study, `beyond` all others.

    What cannot be used in this Python is no part of a group, and `log` names it; by its own name, it is refused.
    Arguments and errors are those of `chosen_tasks`.
    """
    from codesign_bench.method import load_method

    chosen = chosen_names("methods", given, groups("methods"))
    return _without_unusable(chosen, _words(given), load_method if sound else _if_available(load_method), log)


def _if_available(load: Callable[[str], object]) -> Callable[[str], object]:
    """Return a function that loads a member as `load` does, but passes over its faults.

    Raises:
        UnavailableError: the member cannot be used in this Python.
    """

    def load_one(name: str) -> object:
        try:
            return load(name)
        except UnavailableError:
            raise
        except Exception:
            return None

    return load_one


def _without_unusable(chosen: list[str], named: Sequence[str], load: Callable[[str], object], log: Log) -> list[str]:
    """Return the names that can be used; `load` refuses those of the others that are `named`, or one if none can."""
    for name in chosen:
        if name in named:
            load(name)
    found = usable(chosen, load, log)
    if not found:
        load(chosen[0])
    return found


def _words(given: Sequence[str]) -> list[str]:
    """Return the words of an argument; each part of the command line may contain several, separated by commas."""
    return [word for text in given for word in text.split(",") if word]


def check_device(device: str | None) -> None:
    """Check that a requested GPU is available, for `--device` and for `--set device`.

    Raises:
        UserError: it is not.
    """
    if device == "cuda":
        import torch

        if not torch.cuda.is_available():
            raise UserError("--device cuda: torch finds no CUDA device on this machine; choose cpu")
