"""The command line: arguments in, exit code out. 0 is success, 1 a failed cell, 2 bad input, 130 an interruption."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from rich.console import Console

from codesign_bench import __version__
from codesign_bench.config import parse_int
from codesign_bench.errors import UserError, unknown_name
from codesign_bench.profiles import DEFAULT_PROFILE, check_fractions
from codesign_bench.registry import import_modules, names

PROGRAM = "codesign-bench"
EXIT_BAD_INPUT, EXIT_INTERRUPTED = 2, 130
DEFAULT_RESULTS = Path("results/runs")
DEFAULT_FIGURES = Path("results/figures")
ALL = "all"


class _Parser(argparse.ArgumentParser):
    """Answers bad input in two lines."""

    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {' '.join(message.split())}\nsee: {self.prog} --help", file=sys.stderr)
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
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("\ninterrupted; the same command resumes", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of our output, e.g. `head`, has seen enough
        sys.stderr.close()
        return 0


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all commands."""
    parser = _Parser(
        prog=PROGRAM, description="Benchmark methods that learn a tool's design together with its control."
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_list(_add(commands, "list", "names of methods, tasks, figures and profiles", _list))
    _add_show(_add(commands, "show", "the resolved configuration, every value with its source", _show))
    _add_run(_add(commands, "run", "train and evaluate: method x task x variant x seed", _run))
    _add_status(_add(commands, "status", "what a results folder holds and how far it is", _status))
    _add_plot(_add(commands, "plot", "draw the figures that the results allow", _plot))
    return parser


def _add(
    commands: argparse._SubParsersAction[_Parser],
    name: str,
    text: str,
    command: Callable[[argparse.Namespace, Console], int],
) -> argparse.ArgumentParser:
    parser = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
    parser.set_defaults(command=command)
    parser.add_argument(
        "--import",
        dest="imports",
        metavar="MODULE",
        action="append",
        default=[],
        help="a module that defines methods or tasks of your own; may be given several times",
    )
    return parser


def _add_list(parser: argparse.ArgumentParser) -> None:
    del parser  # `list` has no arguments of its own


def _add_show(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--method", required=True, metavar="M")
    parser.add_argument("--task", required=True, metavar="T")
    _add_config(parser)


def _add_config(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--profile", default=DEFAULT_PROFILE, help=f"default: {DEFAULT_PROFILE}")
    parser.add_argument("--steps", type=_whole_number, metavar="N", help="environment steps, instead of the profile's")
    parser.add_argument(
        "--set",
        dest="overrides",
        nargs="+",
        action="extend",
        default=[],
        metavar="KEY=VALUE",
        help="another value of a run setting or hyperparameter; METHOD.KEY=VALUE for one method",
    )


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--method", required=True, nargs="+", metavar="M", help="names, or all: the paper's five")
    parser.add_argument("--task", required=True, nargs="+", metavar="T", help="names, or all")
    parser.add_argument("--seeds", default="1", help="a count (6 is 0-5), a list (0,3,5) or a range (2-4); default: 1")
    _add_config(parser)
    parser.add_argument("--cutout", nargs="+", type=float, default=[], metavar="F", help="fractions never trained on")
    parser.add_argument("--alpha", nargs="+", type=float, default=[], metavar="A", help="trade-off coefficients")
    parser.add_argument("--jobs", type=_whole_number, metavar="N", help="cells at a time; default: as many as cores")
    parser.add_argument("--device", default="cpu", choices=("cpu", "cuda"))
    parser.add_argument("--out", type=Path, default=DEFAULT_RESULTS, metavar="DIR", help=f"default: {DEFAULT_RESULTS}")
    parser.add_argument("--backend", default="loky", choices=("loky", "dask"))
    parser.add_argument("--retry-failed", action="store_true", help="run failed cells again")


def _add_status(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--results", type=Path, default=DEFAULT_RESULTS, metavar="DIR")


def _add_plot(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help="default: every figure that the results allow")
    parser.add_argument("--results", type=Path, default=DEFAULT_RESULTS, metavar="DIR")
    parser.add_argument("--out", type=Path, default=DEFAULT_FIGURES, metavar="DIR", help=f"default: {DEFAULT_FIGURES}")


# The commands import what they need when they run, so that `list` and `--help` need neither torch nor pandas.


def _list(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.show import print_list

    del options
    print_list(console)
    return 0


def _show(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.cell import Cell
    from codesign_bench.show import print_config

    _check_steps(options.steps)
    print_config(
        console,
        Cell(
            options.task,
            options.method,
            seed=0,
            profile=options.profile,
            steps=options.steps,
            overrides=tuple(options.overrides),
        ),
    )
    return 0


def _run(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.cell import check_cells, grid, parse_seeds
    from codesign_bench.runner import run_sweep

    _check_run(options)
    cells = list(
        grid(
            tasks=_names("tasks", options.task, names("tasks")),
            methods=_names("methods", options.method, _paper_methods()),
            seeds=parse_seeds(options.seeds),
            cutouts=list(dict.fromkeys(options.cutout)),
            alphas=list(dict.fromkeys(options.alpha)),
            profile=options.profile,
            steps=options.steps,
            overrides=options.overrides,
        )
    )
    check_cells(cells)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a polite kill is a Ctrl-C
    return run_sweep(cells, options.out, console=console, jobs=options.jobs, retry_failed=options.retry_failed)


def _status(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.show import print_status

    print_status(console, options.results)
    return 0


def _plot(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.plotting import draw_figures

    def say(line: str) -> None:
        console.print(line, markup=False, highlight=False, soft_wrap=True)

    draw_figures(options.figures, options.results, options.out, say)
    return 0


def _check_run(options: argparse.Namespace) -> None:
    """Refuse what can be seen to be wrong from the arguments alone."""
    _check_steps(options.steps)
    check_fractions(options.cutout, options.alpha)
    if options.jobs is not None and options.jobs < 1:
        raise UserError(f"--jobs must be at least 1, not {options.jobs}")
    if options.device != "cpu":
        raise UserError(f"--device {options.device}: this version runs on the cpu alone")
    if options.backend != "loky":
        raise UserError(f"--backend {options.backend}: this version has loky alone")


def _check_steps(steps: int | None) -> None:
    if steps is not None and steps < 1:
        raise UserError(f"--steps must be at least 1, not {steps}")


def _names(group: str, given: Sequence[str], everything: Sequence[str]) -> list[str]:
    """Return the names that an argument means, in the order given: separate words or commas, `all` for `everything`."""
    words = [word for text in given for word in text.split(",") if word]
    chosen = list(dict.fromkeys(name for word in words for name in (everything if word == ALL else (word,))))
    known = names(group)
    for name in chosen:
        if name not in known:
            raise unknown_name(group.rstrip("s"), name, (*known, ALL))
    if not chosen:
        raise UserError(f"--{group.rstrip('s')}: no name given; choose from: {', '.join((*known, ALL))}")
    return chosen


def _paper_methods() -> list[str]:
    """Return what `--method all` means: the built-in methods that the methods folder itself orders."""
    from importlib import import_module

    return list(import_module("codesign_bench.methods").ORDER)


def _whole_number(text: str) -> int:
    try:
        return parse_int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no whole number") from None


def _extend_path(imports: Sequence[str]) -> None:
    """Find `--import` modules in the working folder, as `python -m` would."""
    if imports and "" not in sys.path:
        sys.path.insert(0, "")
