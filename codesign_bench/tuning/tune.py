"""Search the settings of a study's methods, rung by rung, on top of sweeps: `codesign-bench tune`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

from rich.console import Console

from codesign_bench.cell.cell import resolve_cells
from codesign_bench.console import Log, printer
from codesign_bench.errors import UserError
from codesign_bench.method import usable_methods
from codesign_bench.study.study import Study
from codesign_bench.study.tuning import FIRST_REPORTED_SEED, Tuning
from codesign_bench.sweep.runner import EXIT_ALL_DONE, run_sweep
from codesign_bench.task import usable_tasks
from codesign_bench.tuning.expected import expected, print_plan
from codesign_bench.tuning.results import TABLE_FILE, WINNERS_FILE, check_tables, spent, write_table, write_winners
from codesign_bench.tuning.scores import Score, confirmed, pooled, score, survivors
from codesign_bench.tuning.settings import budgets_of, cells_in_turn, settings_of


def tuning_of(study: Study) -> Tuning:
    """Return the study's search.

    Raises:
        UserError: it has none.
    """
    if study.tuning is None:
        raise UserError(f"the study '{study.name}' has no tuning; see docs/tuning.md")
    return study.tuning


def part_of(tuning: Tuning, tasks: Sequence[str], methods: Sequence[str]) -> Tuning:
    """Return the search on these of its tasks and for these of its methods alone.

    Its size and its draws stay the same, so the cells are those of the whole search.

    Raises:
        UserError: a name that is not part of the search.
    """
    for kind, searched, chosen in (("task", tuning.tasks, tasks), ("method", tuning.methods, methods)):
        for name in chosen:
            if name not in searched:
                raise UserError(f"--{kind} {name}: not part of the search; choose from: {', '.join(searched)}")
    return replace(
        tuning,
        tasks=tuple(name for name in tuning.tasks if name in tasks),
        methods=tuple(name for name in tuning.methods if name in methods),
    )


def usable_part(tuning: Tuning, log: Log) -> Tuning:
    """Return the search of the tasks and methods that can be used in this Python; log what is left out.

    Raises:
        UserError: nothing is left.
    """
    tasks, methods = usable_tasks(tuning.tasks, log), usable_methods(tuning.methods, log)
    if not tasks or not methods:
        raise UserError("no task and method of the search can be used in this Python")
    return replace(tuning, tasks=tuple(tasks), methods=tuple(methods))


def tune(
    study: str,
    tuning: Tuning,
    *,
    profile: str,
    out: Path,
    console: Console,
    steps: int | None = None,
    jobs: int | None = None,
    retry_failed: bool = False,
    backend: str = "loky",
    scheduler: str | None = None,
    same_code: bool = False,
    tensorboard: bool = False,
) -> int:
    """Run the missing cells of a study's search and write its files; return 0, or 1 if some cell failed.

    The rungs follow from the search and the stored cells alone, so the same call resumes an interrupted search.

    Raises:
        UserError: bad input, a stored cell with another configuration, or `out` has the tables of a search for other
            tasks or methods.
        KeyboardInterrupt: the user stopped the search.
    """
    log, code = printer(console), EXIT_ALL_DONE
    check_tables(out, tuning)
    budgets = {task: budgets_of(tuning, task, profile, steps) for task in tuning.tasks}
    sweep = partial(
        run_sweep,
        out=out,
        console=console,
        jobs=jobs,
        retry_failed=retry_failed,
        backend=backend,
        scheduler=scheduler,
        same_code=same_code,
        tensorboard=tensorboard,
    )
    alive = [
        setting
        for task, method in product(tuning.tasks, tuning.methods)
        for setting in settings_of(tuning, task, method, profile)
    ]
    scores, kept, winners = list[Score](), list[Score](), list[Score]()
    print_plan(console, tuning, profile, steps)
    log(expected(tuning, profile, steps, out, jobs).line())
    for rung, following in enumerate([*tuning.sizes[1:], 1]):
        log(f"rung {rung + 1} of {tuning.rungs}")
        cells = [setting.cells(tuning, rung, profile, budgets[setting.task][rung]) for setting in alive]
        code = max(code, sweep(resolve_cells(cells_in_turn(cells))))
        found = [score(setting, rung, part, out) for setting, part in zip(alive, cells, strict=True)]
        winners = _choose(tuning, rung, found, following)
        alive = [winner.setting for winner in winners]
        scores += found
        kept += winners
        write_table(out, tuning, scores, kept)
    write_winners(out, {"study": study, "profile": profile}, tuning, scores, winners)
    conclude(log, out, profile, winners, scores)
    return code


def _choose(tuning: Tuning, rung: int, found: Sequence[Score], count: int) -> list[Score]:
    """Return the scores of a rung whose settings go on, `count` of every method; after the last rung, the winners."""
    chosen = (pooled if tuning.pooled else survivors)(found, count)
    if tuning.ahead_on and rung + 1 == tuning.rungs:
        return confirmed(chosen, found, tuning.ahead_on)
    return chosen


def conclude(log: Log, out: Path, profile: str, chosen: list[Score], scores: list[Score]) -> None:
    """Print the best settings, what the search took, and how to train with them."""
    for method, env_steps in spent(scores).items():
        log(f"tuning of {method} took {env_steps:,} environment steps")
    log(f"wrote {out / TABLE_FILE} and {out / WINNERS_FILE}")
    if not chosen:
        log("every setting failed")
        return
    for winner in chosen:
        setting = winner.setting
        log(f"{setting.task} {setting.method}: setting {setting.number}, return {winner.validation_return:.2f}")
        log(f"  --set {' '.join(setting.overrides)}" if setting.values else "  the profile's settings")
    log("train with them on seeds that tuning did not use, for example:")
    log(
        f"codesign-bench run --method {' '.join(dict.fromkeys(found.setting.method for found in chosen))} "
        f"--task {' '.join(dict.fromkeys(found.setting.task for found in chosen))} --profile {profile} "
        f"--seeds {FIRST_REPORTED_SEED}-{FIRST_REPORTED_SEED + 9} --tuned {out / WINNERS_FILE} --out results/tuned"
    )
