"""`codesign-bench check`: ask a task or a method for everything that is promised of it; say in words what is wrong."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

from rich.console import Console

from codesign_bench.cli.arguments import chosen_methods, chosen_tasks
from codesign_bench.console import Log, printer
from codesign_bench.errors import UserError

if TYPE_CHECKING:
    from codesign_bench.contract import Verdict

HELP = "check that a task or a method keeps the contract of its kind, and say in words what is wrong"
EXIT_ALL_SOUND, EXIT_SOME_WRONG = 0, 1
PASSED, LEFT_OUT, WRONG = "passed", "left out", "wrong"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what to check, and the task on which methods are examined."""
    parser.add_argument("--task", nargs="+", default=[], metavar="T", help="names that `list` shows, all or beyond")
    parser.add_argument("--method", nargs="+", default=[], metavar="M", help="names that `list` shows, all or beyond")
    parser.add_argument(
        "--on", metavar="T", help="task on which methods are examined; default: the first that `list` shows"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    """Print each check of each member as it ends; return 1 if something is wrong."""
    from codesign_bench.contract import examine_method, examine_task
    from codesign_bench.task import load_task, task_names, usable_tasks

    if not options.task and not options.method:
        raise UserError("check: give --task or --method")
    if options.on and not options.method:
        raise UserError("check: --on is the task on which methods are examined; give --method, too")
    log = printer(console)
    examined: list[tuple[str, Callable[[], Iterator[Verdict]]]] = []
    if options.task:
        examined += [
            (f"task {name}", partial(examine_task, name)) for name in chosen_tasks(options.task, log, sound=False)
        ]
    if options.method:
        on = load_task(options.on or usable_tasks(task_names())[0])
        names = chosen_methods(options.method, log, sound=False)
        examined += [(f"method {name} on {on.name}", partial(examine_method, name, on)) for name in names]
    wrong = [title for title, examine in examined if not _keeps_all(title, examine(), log)]
    if len(examined) > 1:
        log(f"{len(examined) - len(wrong)} of {len(examined)} keep the contract" + _named(wrong))
    return EXIT_SOME_WRONG if wrong else EXIT_ALL_SOUND


def _named(wrong: list[str]) -> str:
    return f"; not: {', '.join(wrong)}" if wrong else ""


def _keeps_all(title: str, verdicts: Iterator[Verdict], log: Log) -> bool:
    """Print the verdicts on a member as they come; return whether nothing is wrong."""
    log(title)
    counts = {PASSED: 0, LEFT_OUT: 0, WRONG: 0}
    for verdict in verdicts:
        kind = WRONG if verdict.faults else LEFT_OUT if verdict.left_out else PASSED
        counts[kind] += 1
        log(f"  {kind:8}  {verdict.check.promise}" + (f" ({verdict.left_out})" if verdict.left_out else ""))
        for fault in verdict.faults:
            log(f"            found:    {fault.found}")
            log(f"            expected: {fault.expected}")
        if verdict.faults:
            log(f"            read:     {verdict.check.read}")
            if verdict.check.first:
                log("  The other checks mean nothing before this is right.")
    log(f"{title}: " + ", ".join(f"{count} {kind}" for kind, count in counts.items() if count))
    return not counts[WRONG]
