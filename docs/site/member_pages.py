"""The pages that list tasks and methods, with what the shipped results say of them."""

from __future__ import annotations

import csv
import inspect

from assemble import ROOT, SHOWN, title_of
from codesign_bench.method import load_method, method_names
from codesign_bench.registry import built_in, load_module
from codesign_bench.study import DEFAULT_STUDY, load_study
from codesign_bench.task import load_task
from fragments import first_sentence, table, toctree
from motion_pages import asked, tasks_in_motion


def tasks() -> str:
    """Return the page that lists the tasks."""
    rows = [(f"[{name}](docs/tasks/{name}.md)", asked(name), *_sizes(name)) for name in built_in("tasks")]
    header = ("task", "what it asks for", "design", "control", "goal", "steps")
    lead = (
        "The numbers count the parameters of a design, of a control and of a goal, and the control steps of an episode."
    )
    return f"# Tasks\n\n{lead}\n\n{table(header, rows)}\n\n{tasks_in_motion('../')}" + toctree(built_in("tasks"))


def _sizes(name: str) -> tuple[str, ...]:
    task = load_task(name)
    sizes = task.design_space.size, task.control_space.size, task.goal_size, task.horizon
    return tuple(str(size) for size in sizes)


def methods() -> str:
    """Return the table of methods: what learns, one tool or one per goal, source, results."""
    scores = average_scores()
    rows = []
    for name in built_in("methods"):
        method = load_method(name)
        summary, source = told_by_module(name)
        tools = "one per goal" if method.tool_per_goal else "one for all goals"
        score = scores.get(name, "not shipped")
        rows.append((f"[{name}](docs/methods/{name}.md)", summary, tools, source, score))
    header = ("method", "what learns", "tool", "source", "normalised score")
    paper, beyond = (rows[: len(load_study(DEFAULT_STUDY).methods)], rows[len(load_study(DEFAULT_STUDY).methods) :])
    lead = (
        "The last column is the mean over tasks of the [normalised score](docs/reference_points.md#normalised-scores) "
        "at the end of training in the [shipped results](results/reference/README.md), with its 95 % interval."
    )
    extra = sorted(
        path.stem for path in (ROOT / "docs" / "methods").glob("*.md") if path.stem not in built_in("methods")
    )
    shared = ", ".join(f"[{title_of(f'docs/methods/{name}.md')}](docs/methods/{name}.md)" for name in extra)
    parts = [
        "# Methods",
        lead,
        f"## The methods of the paper\n\n{table(header, paper)}",
        f"## Methods beyond the paper\n\n{table(header, beyond)}",
        f"## Success of each method on each task\n\n{success()}",
        f"What several methods share: {shared}.",
    ]
    return "\n\n".join(parts) + toctree([*built_in("methods"), *extra])


def told_by_module(name: str) -> tuple[str, str]:
    """Return what a method's module says of it: its first paragraph, and its source (or "ours")."""
    doc = inspect.getdoc(load_module("methods", name)) or ""
    paragraphs = [" ".join(part.split()) for part in doc.split("\n\n")]
    source = next((part.removeprefix("Source: ") for part in paragraphs if part.startswith("Source: ")), "ours")
    return paragraphs[0].removesuffix(" (ours)."), first_sentence(source)


def final_results() -> list[dict[str, str]]:
    """Return the rows of the shipped figure of final results."""
    with (SHOWN / "figures" / "final_results.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def average_scores() -> dict[str, str]:
    """Return method -> its mean normalised score over tasks, with its interval."""
    return {row["method"]: _interval(row, "normalized_score") for row in final_results() if row["task"] == "average"}


def success() -> str:
    """Return the table of success rates of the shipped results."""
    rows_of_tasks = [row for row in final_results() if row["success_rate"]]
    found = {(row["task"], row["method"]): _interval(row, "success_rate") for row in rows_of_tasks}
    columns = [name for name in method_names() if any(method == name for _, method in found)]
    rows = [
        (f"[{task}](docs/tasks/{task}.md)", *(found.get((task, name), "-") for name in columns))
        for task in built_in("tasks")
        if any(one == task for one, _ in found)
    ]
    return table(("task", *columns), rows)


def _interval(row: dict[str, str], column: str) -> str:
    value, low, high = (row[key] for key in (column, f"{column}_low", f"{column}_high"))
    # The space inside the brackets does not break a line.
    return f"{float(value):.2f}" + (f" [{float(low):.2f},\N{NO-BREAK SPACE}{float(high):.2f}]" if low else "")
