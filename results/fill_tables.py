"""Fill the tables of the pages that show shipped results: `python results/fill_tables.py [--check]`.

A table stands between `<!-- NAME -->` and `<!-- end -->`. With `--check` nothing is written; the exit code is 1 when a
page is not what the results say.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from codesign_bench.cell.variant import DEFAULT, Variant
from codesign_bench.claims.evidence import load_evidence
from codesign_bench.claims.finding import probability
from codesign_bench.claims.judging import Row, judge
from codesign_bench.claims.page import by_rule, contradicted
from codesign_bench.config.profiles import BUILT_IN
from codesign_bench.config.resolve import resolve
from codesign_bench.figures.source import Request, final_curves
from codesign_bench.method import load_method
from codesign_bench.registry import built_in, in_order, load_module
from codesign_bench.sharing.leaderboard import leaderboard
from codesign_bench.stats import final_values, welch_across
from codesign_bench.storage.frames import stored_curves
from codesign_bench.storage.layout import CURVE_COLUMNS
from codesign_bench.storage.reference_points import FILE, POINTS, load_reference_points, with_reference_points
from codesign_bench.study import DEFAULT_STUDY, load_study
from codesign_bench.text_tables import markdown
from codesign_bench.tuning.results import TABLE_FILE
from codesign_bench.tuning.scores import mean_ranks

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "results" / "reference"
ALL_METHODS = ROOT / "results" / "all_methods"
SECOND_MACHINE = ROOT / "results" / "second_machine"
SUBMISSIONS = ROOT / "results" / "submissions"
SEARCH = ROOT / "results" / "search"
PLATEAU = ROOT / "results" / "plateau"
PAGES = {
    ROOT / "docs" / "results.md": REFERENCE,
    ROOT / "docs" / "reference_points.md": REFERENCE,
    ROOT / "docs" / "budgets.md": REFERENCE,
    ROOT / "docs" / "leaderboard.md": SUBMISSIONS,
    REFERENCE / "README.md": REFERENCE,
    ALL_METHODS / "README.md": ALL_METHODS,
    SECOND_MACHINE / "README.md": SECOND_MACHINE,
    ROOT / "results" / "TUNING.md": SEARCH,
}
"""Every page and the results, or the folder of archives, that its tables show."""
PAPERS_METHOD = "gnn_ppo"
ARCHITECTURES = (PAPERS_METHOD, "shared_arch")
SEPARATE = Variant.of(credit="separate")
NOT_MEASURED = "Reference points of these results are not measured yet.\n"
TABLE = re.compile(r"(<!-- (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def _final_results(results: Path) -> str:
    return load_module("paper_figs", "final_results").texts(_curves(results))["md"]


def _success(results: Path) -> str:
    final = load_module("paper_figs", "final_results")
    return final.success_by_task(final.data(_curves(results)))


@lru_cache
def _curves(results: Path) -> pd.DataFrame:
    return final_curves(Request(results))


def _reference_points(results: Path) -> str:
    """Return mean return and success of every point and task, in one cell of the table each."""
    if not (results / FILE).exists():
        return NOT_MEASURED
    rows = load_reference_points(results).to_dict("records")
    told = {(row["task"], row["point"]): f"{row['return_mean']:.2f} ({row['success_rate']:.2f})" for row in rows}
    header = ["task", *(point.replace("_", " ") for point in POINTS)]
    tasks = in_order("tasks", [task for task, _ in told])
    lines = [[task.replace("_", " "), *(told.get((task, point), "-") for point in POINTS)] for task in tasks]
    return markdown(header, lines)


def _script(results: Path) -> str:
    """Return in a sentence on which tasks the hand-written script solves more than the paper's method."""
    if not (results / FILE).exists():
        return ""
    final = load_module("paper_figs", "final_results")
    table = final.per_task(final.data(_curves(results)))
    both = table[table["method"] == PAPERS_METHOD].set_index("task")
    points = load_reference_points(results)
    scripts = points[points["point"] == "script"].set_index("task")
    learned, scripted = both["success_rate"], scripts["success_rate"]
    tasks = in_order("tasks", set(learned.index) & set(scripted.index))
    ahead = [task for task in tasks if scripted[task] > learned[task]]
    behind = [task for task in tasks if task not in ahead]
    ours, theirs = (", ".join(_both(task, scripted, learned) for task in group) for group in (ahead, behind))
    others = f", and no more on the others ({theirs})" if behind else ""
    counted = f"{len(ahead)} of {len(tasks)} tasks ({ours})"
    earning = sum(scripts["return_mean"][task] > both["return_mean"][task] for task in tasks)
    return (
        f"A script written by hand solves more instances than `{PAPERS_METHOD}`, mean over seeds, on {counted}{others}."
        f" Its return is higher on {earning} of {len(tasks)}.\n"
    )


def _both(task: str, scripted: pd.Series[float], learned: pd.Series[float]) -> str:
    """Return a task with both of its success rates."""
    return f"{task.replace('_', ' ')} {scripted[task]:.2f} to {learned[task]:.2f}"


def _response(results: Path) -> str:
    """Return what a separate credit, and then the response term of `stackelberg_ppo`, add to success on each task."""
    steps = ((PAPERS_METHOD, DEFAULT), (PAPERS_METHOD, SEPARATE), ("stackelberg_ppo", DEFAULT))
    found = _successes(results, steps)
    lines = [
        [task.replace("_", " "), *map(_seeds, samples), *(_difference([pair]) for pair in _added(samples))]
        for task, samples in found.items()
    ]
    credits, responses = zip(*map(_added, found.values()), strict=True)
    lines.append([f"mean of {len(found)} tasks", "", "", "", _difference(credits), _difference(responses)])
    header = ["task", "joint credit", "separate credit", "separate credit and response", "credit adds", "response adds"]
    return markdown(header, lines)


def _credit(results: Path) -> str:
    """Return what a separate credit adds to the success of either architecture on each task."""
    lines = []
    for method in ARCHITECTURES:
        found = _successes(results, ((method, DEFAULT), (method, SEPARATE)))
        added = [pair for samples in found.values() for pair in _added(samples)]
        lines += [
            [f"`{method}`", task.replace("_", " "), *map(_seeds, samples), _difference([pair])]
            for (task, samples), pair in zip(found.items(), added, strict=True)
        ]
        if len(added) > 1:
            lines.append([f"`{method}`", f"mean of {len(added)} tasks", "", "", _difference(added)])
    return markdown(["method", "task", "joint credit", "separate credit", "separate credit adds"], lines)


def _machines(results: Path) -> str:
    """Return each seed's success in the reference results and in `results`, and how many curves are the same."""
    cell, lines = ["task", "method", "variant", "seed"], []
    sides = [
        _curves(folder).set_index(cell)[[*CURVE_COLUMNS]].drop(columns="wall_s") for folder in (REFERENCE, results)
    ]
    for task, method in sides[1].index.droplevel(["variant", "seed"]).unique():
        there, here = (side.loc[(task, method, DEFAULT.name)] for side in sides)
        seeds = sorted({*there.index} & {*here.index})
        samples = [side.groupby("seed")["success_rate"].last().loc[seeds].to_numpy() for side in (there, here)]
        same = sum(there.loc[[seed]].equals(here.loc[[seed]]) for seed in seeds)
        lines.append([task.replace("_", " "), f"`{method}`", *map(_seeds, samples), f"{same} of {len(seeds)}"])
    return markdown(["task", "method", "reference results", "here", "curves equal to the bit"], lines)


def _successes(results: Path, sides: Sequence[tuple[str, Variant]]) -> dict[str, list[np.ndarray]]:
    """Return each seed's success at the end of training for every side, (method, variant), on the tasks of all."""
    last = final_values(_curves(results), "success_rate")
    found = {}
    for task in in_order("tasks", set(last["task"])):
        rows = last[last["task"] == task]
        samples = [
            rows.loc[(rows["method"] == method) & (rows["variant"] == variant.name), "success_rate"].to_numpy()
            for method, variant in sides
        ]
        if all(len(sample) for sample in samples):
            found[task] = samples
    return found


def _seeds(sample: np.ndarray) -> str:
    """Return the mean of a sample, and every seed."""
    return f"{sample.mean():.2f} ({', '.join(f'{value:.2f}' for value in sample)})"


def _added(samples: Sequence[np.ndarray]) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Return the pairs (with, without) of neighbours in a row of samples, each of which adds one thing to the last."""
    return tuple((later, earlier) for earlier, later in pairwise(samples))


def _budgets() -> str:
    """Return the environment steps of a cell on every task under each built-in profile."""
    method = load_method(PAPERS_METHOD)
    rows = [
        [task, *(f"{resolve(method, task, profile).run.steps:,}" for profile in BUILT_IN)] for task in built_in("tasks")
    ]
    return markdown(["task", *(f"`{profile}`" for profile in BUILT_IN)], rows)


def _plateau() -> str:
    """Return how much curves on tuning seeds still rose at the budgets that were tried for `workstation`."""
    final = load_module("paper_figs", "final_results")
    lines = []
    for budget in sorted(PLATEAU.iterdir(), key=lambda folder: int(folder.name)):
        # Their best known is that of the results of all methods, which have the same versions of the tasks.
        table = final.per_task(final.data(with_reference_points(stored_curves(budget, finished=True), ALL_METHODS)))
        lines += [
            [
                row["task"],
                f"{row['seeds']}",
                f"{row['env_steps']:,.0f}",
                *(f"{row[name]:.2f}" for name in ("success_rate", "normalized_score")),
                f"{row['late_gain']:+.3f}",
            ]
            for row in table.to_dict("records")
        ]
    lines.sort(key=lambda line: built_in("tasks").index(line[0]))
    return markdown(["task", "number of seeds", "steps", "success", "normalised score", "late gain"], lines)


def _search(results: Path) -> str:
    """Return what the common search found for every method, one line each."""
    table = pd.read_csv(results / TABLE_FILE)
    lines = []
    for method in in_order("methods", table["method"].unique()):
        own = table[table["method"] == method]
        returns = own.pivot(index="task", columns="setting", values="validation_return")
        ranks = mean_ranks(returns)
        present, *changes = ranks
        best = min(changes, key=ranks.__getitem__)
        ahead = int((returns[best] > returns[present]).sum())
        (kept,) = own.loc[own["kept"] == 1, "setting"].unique()
        lines.append(
            [
                f"`{method}`",
                f"{own['env_steps'].sum():,}",
                f"{ranks[present]:.1f}",
                f"{best}: {ranks[best]:.1f}",
                f"{ahead} of {len(returns)}",
                "as before" if kept == present else f"change {kept}",
            ]
        )
    header = ["method", "steps of the search", "mean rank of the present settings", "best change: its mean rank"]
    return markdown([*header, "tasks on which it is ahead", "used"], lines)


def _difference(pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> str:
    """Return the mean difference within pairs, with Welch's interval and p-value."""
    found = welch_across(pairs)
    p = probability(found.p)
    return f"{found.value:+.2f} [{found.low:.2f}, {found.high:.2f}], p {p if p.startswith('<') else f'= {p}'}"


@lru_cache
def _judged(results: Path) -> list[Row]:
    claims = load_study(DEFAULT_STUDY).claims()
    return judge(claims, load_evidence(results), results.relative_to(ROOT).as_posix())


MAKERS: dict[str, Callable[[Path], str]] = {
    "final_results": _final_results,
    "success": _success,
    "reference_points": _reference_points,
    "script": _script,
    "response": _response,
    "credit": _credit,
    "machines": _machines,
    "search": _search,
    "leaderboard": lambda folder: leaderboard(folder, "../results/submissions"),
    "budgets": lambda _: _budgets(),
    "plateau": lambda _: _plateau(),
    "claims": lambda results: by_rule([row for row in _judged(results) if row.asked]),
    "contradicted": lambda results: contradicted(_judged(results)),
}
"""Every table by its name, made from a results folder."""


def filled(page: str, results: Path) -> str:
    """Return a page with every table made anew from `results`."""
    return TABLE.sub(lambda found: f"{found[1]}\n{MAKERS[found['name']](results)}\n{found[3]}", page)


def main() -> int:
    """Fill or check the pages and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    stale = []
    for path, results in PAGES.items():
        page = path.read_text(encoding="utf-8")
        made = filled(page, results)
        if made != page:
            stale.append(path)
            if not check:
                path.write_text(made, encoding="utf-8")
    print("\n".join(f"{'stale' if check else 'filled'}: {path.relative_to(ROOT)}" for path in stale) or "up to date")
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
