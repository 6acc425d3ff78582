"""The command line: arguments in, exit code out. 0 is success, 1 a failed cell, 2 bad input, 130 an interruption."""

from __future__ import annotations

import argparse
import re
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from rich.console import Console

from codesign_bench import __version__
from codesign_bench.config import parse_int
from codesign_bench.errors import UserError, unknown_name
from codesign_bench.profiles import DEFAULT_PROFILE, DEVICES, PRECISIONS, check_fractions
from codesign_bench.registry import import_modules, names

PROGRAM = "codesign-bench"
EXIT_BAD_INPUT, EXIT_INTERRUPTED = 2, 130
DEFAULT_RESULTS = Path("results/runs")
DEFAULT_FIGURES = Path("results/figures")
DEFAULT_CLAIMS = Path("results/claims")
DEFAULT_REPORT = Path("results/report.html")
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
    _add_verify(_add(commands, "verify", "which of the paper's claims the results support", _verify))
    _add_report(_add(commands, "report", "write one page that tells everything a results folder holds", _report))
    _add_reproduce(_add(commands, "reproduce", "run what figures of the paper need, then draw them", _reproduce))
    _add_render(_add(commands, "render", "draw what a policy does, as an animation or a picture", _render))
    _add_deploy(_add(commands, "deploy", "try a policy and its tools on a simulated robot arm", _deploy))
    _add_export(_add(commands, "export", "write a policy's tools as solids to print", _export))
    _add_bench(_add(commands, "bench", "measure speed on this machine", _bench))
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


def _overrides(options: argparse.Namespace) -> list[str]:
    """Return the `--set` entries, and those that stand for --device and --precision, where a method has any use."""
    from dataclasses import fields

    from codesign_bench.host import computes_in_bfloat16
    from codesign_bench.method import load_method

    result = list(options.overrides)
    if options.device is not None:
        result.append(f"device={options.device}")
    if options.precision is not None:
        chosen = "bf16" if options.precision == "auto" and computes_in_bfloat16() else "fp32"
        methods = _names("methods", options.method, _paper_methods())
        keys = {field.name for name in methods for field in fields(load_method(name).config_class)}
        result += [f"precision={chosen}"] if "precision" in keys else []
    return result


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--method", required=True, nargs="+", metavar="M", help="names, or all: the paper's five")
    parser.add_argument("--task", required=True, nargs="+", metavar="T", help="names, or all")
    parser.add_argument("--seeds", default="1", help="a count (6 is 0-5), a list (0,3,5) or a range (2-4); default: 1")
    _add_config(parser)
    parser.add_argument("--cutout", nargs="+", type=float, default=[], metavar="F", help="fractions never trained on")
    parser.add_argument("--alpha", nargs="+", type=float, default=[], metavar="A", help="trade-off coefficients")
    parser.add_argument(
        "--finetune", nargs="+", type=_whole_number, default=[], metavar="N", help="go on with such instances alone"
    )
    parser.add_argument(
        "--scratch", nargs="+", type=_whole_number, default=[], metavar="N", help="learn such instances from scratch"
    )
    parser.add_argument("--jobs", type=_whole_number, metavar="N", help="cells at a time; default: as many as cores")
    parser.add_argument("--device", choices=DEVICES, help="where networks are updated; default: cpu")
    parser.add_argument(
        "--precision", choices=PRECISIONS, help="auto: bfloat16 in updates where the processor has it; default: fp32"
    )
    parser.add_argument("--out", type=Path, default=DEFAULT_RESULTS, metavar="DIR", help=f"default: {DEFAULT_RESULTS}")
    parser.add_argument("--backend", default="loky", choices=("loky", "dask"), help="default: loky, this machine")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster; without, --backend dask starts one")
    parser.add_argument("--retry-failed", action="store_true", help="run failed cells again")


def _add_status(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--results", type=Path, default=DEFAULT_RESULTS, metavar="DIR")


def _add_plot(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help="default: every figure that the results allow")
    parser.add_argument("--results", type=Path, default=DEFAULT_RESULTS, metavar="DIR")
    parser.add_argument("--out", type=Path, default=DEFAULT_FIGURES, metavar="DIR", help=f"default: {DEFAULT_FIGURES}")
    parser.add_argument(
        "--compare", type=Path, metavar="DIR", help="draw learning curves of these results besides, dashed"
    )


def _add_verify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--results", type=Path, default=DEFAULT_RESULTS, metavar="DIR")
    parser.add_argument("--out", type=Path, default=DEFAULT_CLAIMS, metavar="DIR", help=f"default: {DEFAULT_CLAIMS}")
    parser.add_argument(
        "--measure", action="store_true", help="first play tools and policies where claims need it; takes minutes"
    )


def _add_report(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--results", type=Path, default=DEFAULT_RESULTS, metavar="DIR")
    parser.add_argument("--out", type=Path, default=DEFAULT_REPORT, metavar="FILE", help=f"default: {DEFAULT_REPORT}")


def _add_reproduce(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("experiments", nargs="*", metavar="FIGURE", help="names, or all (default)")
    parser.add_argument("--profile", default=DEFAULT_PROFILE, help=f"default: {DEFAULT_PROFILE}")
    parser.add_argument("--seeds", type=_whole_number, metavar="N", help="seeds of every cell, instead of the paper's")
    parser.add_argument("--jobs", type=_whole_number, metavar="N", help="cells at a time; default: as many as cores")
    parser.add_argument("--out", type=Path, default=DEFAULT_RESULTS, metavar="DIR", help=f"default: {DEFAULT_RESULTS}")
    parser.add_argument("--figures", type=Path, default=DEFAULT_FIGURES, metavar="DIR", help="where figures go")


def _add_render(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--task", metavar="T", help="default: the task of --policy")
    parser.add_argument("--policy", type=Path, metavar="CELL", help="a finished cell's folder; its final policy acts")
    parser.add_argument(
        "--behaviour", choices=("random", "script"), help="what acts without --policy; default: the task's script"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="ends in .gif or .png")
    parser.add_argument("--episodes", type=_whole_number, default=4, metavar="N", help="default: 4")
    parser.add_argument("--seed", type=_seed, default=0, help="of random behaviour; default: 0")


def _add_deploy(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--policy", type=Path, required=True, metavar="CELL", help="a finished cell's folder")
    parser.add_argument("--task", metavar="T", help="default: the task of --policy")
    parser.add_argument(
        "--protocol", action="store_true", help="the paper's Table 1: five trials of each tool, and the grid of starts"
    )
    parser.add_argument("--tool", nargs="+", type=_whole_number, default=[], metavar="N", help="default: all of them")
    parser.add_argument("--trials", type=_whole_number, metavar="N", help="of each tool; default: 1")
    parser.add_argument("--arm", help="panda (default), or ideal: the gantry of training")
    parser.add_argument(
        "--observation-noise", type=float, metavar="M", help="deviation of lengths, m; default: 0, protocol 0.002"
    )
    parser.add_argument("--latency", type=_whole_number, metavar="STEPS", help="default: 0, protocol 1")
    parser.add_argument("--friction", type=float, metavar="SHARE", help="largest change; default: 0, protocol 0.2")
    parser.add_argument("--mass", type=float, metavar="SHARE", help="largest change; default: 0, protocol 0.2")
    parser.add_argument("--seed", type=_seed, default=0, help="of noise and changes; default: 0")
    parser.add_argument("--no-gifs", action="store_true", help="do not draw the trials")
    parser.add_argument("--out", type=Path, default=DEFAULT_RESULTS, metavar="DIR", help=f"default: {DEFAULT_RESULTS}")


def _add_export(parser: argparse.ArgumentParser) -> None:
    # So that values that start with a minus sign, as in `--start -0.2,0.7`, are no options.
    parser._negative_number_matcher = re.compile(r"^-\.?\d")
    parser.add_argument("--policy", type=Path, required=True, metavar="CELL", help="a finished cell's folder")
    parser.add_argument("--task", metavar="T", help="default: the task of --policy")
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--start", metavar="X,Y", help="the tool for an object that starts there, m")
    which.add_argument("--goal", metavar="G,...", help="the tool for this goal, in the task's units")
    which.add_argument("--instances", metavar="N,...", help="tools for these evaluation instances, or all")
    parser.add_argument("--scale", type=float, default=1.0, metavar="S", help="size of the print; default: 1")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")


def _add_bench(parser: argparse.ArgumentParser) -> None:
    kinds = parser.add_subparsers(required=True, metavar="tasks|learner", dest="what")
    tasks = kinds.add_parser("tasks", help="environment steps beside the raw engine", allow_abbrev=False)
    tasks.add_argument("--task", nargs="+", default=[ALL], metavar="T", help="names, or all (default)")
    tasks.add_argument("--seconds", type=float, default=5.0, metavar="S", help="for each; default: 5")
    learner = kinds.add_parser("learner", help="our learners beside others'", allow_abbrev=False)
    learner.add_argument("--task", default="push", metavar="T", help="default: push")
    learner.add_argument("--cores", type=_whole_number, default=1, metavar="N", help="default: 1")
    learner.add_argument("--cells", type=_whole_number, default=1, metavar="N", help="cells at once; default: 1")
    learner.add_argument("--batch-size", type=_whole_number, default=50_000, metavar="N", help="default: 50000")
    learner.add_argument("--minibatch-size", type=_whole_number, default=2_000, metavar="N", help="default: 2000")
    learner.add_argument("--epochs", type=_whole_number, default=10, metavar="N", help="default: 10")
    learner.add_argument("--repeats", type=_whole_number, default=3, metavar="N", help="default: 3")
    learner.add_argument("--only", nargs="+", metavar="NAME", help="some of the learners; default: all")
    learner.add_argument("--out", type=Path, metavar="FILE", help="write the numbers there as JSON")


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
            finetunes=list(dict.fromkeys(options.finetune)),
            scratches=list(dict.fromkeys(options.scratch)),
            profile=options.profile,
            steps=options.steps,
            overrides=_overrides(options),
        )
    )
    check_cells(cells)
    _check_device(cells[0].config().run.device)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a polite kill is a Ctrl-C
    return run_sweep(
        cells,
        options.out,
        console=console,
        jobs=options.jobs,
        retry_failed=options.retry_failed,
        backend=options.backend,
        scheduler=options.scheduler,
    )


def _status(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.show import print_status

    print_status(console, options.results)
    return 0


def _plot(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.plotting import draw_figures

    draw_figures(options.figures, options.results, options.out, _printer(console), options.compare)
    return 0


def _report(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.report.page import write_report

    write_report(options.results, options.out, _printer(console))
    return 0


def _printer(console: Console) -> Callable[[str], None]:
    """Return a function that prints a line as it is."""

    def say(line: str) -> None:
        console.print(line, markup=False, highlight=False, soft_wrap=True)

    return say


def _reproduce(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.profiles import run_profile
    from codesign_bench.reproduce import reproduce

    run_profile(options.profile, "push")  # refuses an unknown profile before anything runs
    for name in ("seeds", "jobs"):
        if getattr(options, name) is not None and getattr(options, name) < 1:
            raise UserError(f"--{name} must be at least 1, not {getattr(options, name)}")
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a polite kill is a Ctrl-C
    return reproduce(
        options.experiments,
        profile=options.profile,
        results=options.out,
        figures=options.figures,
        console=console,
        jobs=options.jobs,
        seeds=options.seeds,
    )


def _verify(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.claims.verify import verify

    verify(options.results, options.out, console, measure=options.measure)
    return 0


def _render(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.policy_files import policy_and_task
    from codesign_bench.rendering import RandomBehaviour, render
    from codesign_bench.seeding import generator
    from codesign_bench.task import load_task

    if options.policy is None and options.task is None:
        raise UserError("render: name a --task, or a --policy, which knows its task")
    if options.policy is not None and options.behaviour is not None:
        raise UserError("render: either --policy or --behaviour acts, not both")
    if options.episodes < 1:
        raise UserError(f"--episodes must be at least 1, not {options.episodes}")
    if options.policy is not None:
        policy, task = policy_and_task(options.policy, options.task)
        line = render(task, policy, options.out, options.episodes)
    else:
        task = load_task(options.task)
        random = options.behaviour == "random"
        behaviour = RandomBehaviour(task, generator(options.seed, "render")) if random else task.script()
        line = render(task, behaviour, options.out, options.episodes)
    console.print(line, markup=False, highlight=False, soft_wrap=True)
    return 0


def _deploy(options: argparse.Namespace, console: Console) -> int:
    from dataclasses import replace

    from codesign_bench.deployment.conditions import TRIAL, Conditions
    from codesign_bench.deployment.deploy import Order, deploy
    from codesign_bench.policy_files import policy_and_task

    if options.protocol and (options.tool or options.trials is not None):
        raise UserError("deploy: --protocol sets tools and trials itself; leave out --tool and --trials")
    names = ("arm", "observation_noise", "latency", "friction", "mass")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    conditions = replace(TRIAL if options.protocol else Conditions(), **given)
    conditions.check()
    order = Order(
        conditions,
        tools=tuple(options.tool),
        trials=1 if options.trials is None else options.trials,
        protocol=options.protocol,
        seed=options.seed,
        gifs=not options.no_gifs,
    )
    policy, task = policy_and_task(options.policy, options.task)
    deploy(task, policy, order, options.out, _printer(console), str(options.policy))
    return 0


def _export(options: argparse.Namespace, console: Console) -> int:
    from codesign_bench.fabrication.export import Order, export
    from codesign_bench.policy_files import policy_and_task

    policy, task = policy_and_task(options.policy, options.task)
    order = Order.of(task, start=options.start, goal=options.goal, instances=options.instances, scale=options.scale)
    export(task, policy, order, options.out, _printer(console), str(options.policy))
    return 0


def _bench(options: argparse.Namespace, console: Console) -> int:
    if options.what == "tasks":
        from codesign_bench.benchmarks.tasks import bench_tasks

        bench_tasks(_names("tasks", options.task, names("tasks")), options.seconds, console)
        return 0
    from codesign_bench.benchmarks.learner import Workload, bench_learner, contestants

    for name in ("cores", "cells", "batch_size", "minibatch_size", "epochs", "repeats"):
        if getattr(options, name) < 1:
            raise UserError(f"--{name.replace('_', '-')} must be at least 1, not {getattr(options, name)}")
    wanted = options.only or list(contestants())
    for name in wanted:
        if name not in contestants():
            raise unknown_name("learner", name, contestants())
    work = Workload(
        task=options.task,
        batch_size=options.batch_size,
        minibatch_size=options.minibatch_size,
        epochs=options.epochs,
        cores=options.cores,
        cells=options.cells,
        repeats=options.repeats,
    )
    bench_learner(work, wanted, options.out, console)
    return 0


def _check_run(options: argparse.Namespace) -> None:
    """Refuse what can be seen to be wrong from the arguments alone."""
    _check_steps(options.steps)
    check_fractions(options.cutout, options.alpha)
    if options.jobs is not None and options.jobs < 1:
        raise UserError(f"--jobs must be at least 1, not {options.jobs}")


def _check_device(device: str) -> None:
    """Refuse a GPU that is not there: `--device` and `--set device` alike."""
    if device == "cuda":
        import torch

        if not torch.cuda.is_available():
            raise UserError("--device cuda: torch finds no such device here; choose cpu")


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


def _seed(text: str) -> int:
    if (seed := _whole_number(text)) < 0:
        raise argparse.ArgumentTypeError(f"a seed is at least 0, not {seed}")
    return seed


def _extend_path(imports: Sequence[str]) -> None:
    """Find `--import` modules in the working folder, as `python -m` would."""
    if imports and "" not in sys.path:
        sys.path.insert(0, "")
