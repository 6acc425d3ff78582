"""Write the pages of the presented tasks, docs/tasks/<task>.md, from the tasks themselves and from hand-written notes.

    python docs/make_task_pages.py            write them
    python docs/make_task_pages.py --check    write nothing; fail if one of them is out of date

A page has the class's docstring, section by section, with tables from the code: spaces, terms of the reward, conditions
of success, the cutout, guarantees of the physics, constants with their sources. Hand-written notes, mainly
measurements, are in docs/tasks/notes/<task>.md and come last.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from codesign_bench.registry import presented
from codesign_bench.task import Box, Layout, Task, load_task, simulator
from codesign_bench.task.envs import environment_id

ROOT = Path(__file__).resolve().parent.parent
PAGES, NOTES = ROOT / "docs" / "tasks", ROOT / "docs" / "tasks" / "notes"
SECTION = re.compile(r"^(\w[\w ]*)\n((?:    .*\n?|\n)+)", re.MULTILINE)
"""A title in a class's docstring, and the indented text below it."""
SIBLING = re.compile(r"^from \.(_\w+) import", re.MULTILINE)
"""An import of a file that several tasks share."""
WIDTH = 120
LONG = 10
"""So many numbered entries of an observation, or more, share one row."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the pages, or check them; return the exit code."""
    parser = argparse.ArgumentParser(description="Write the pages of the presented tasks.")
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a page is out of date")
    options = parser.parse_args(arguments)
    stale = [path for path, text in pages() if not path.exists() or path.read_text(encoding="utf-8") != text]
    if options.check:
        for path in stale:
            print(f"{path.relative_to(ROOT)} is out of date: run python docs/make_task_pages.py", file=sys.stderr)
        return 1 if stale else 0
    for path, text in pages():
        path.write_text(text, encoding="utf-8")
    return 0


def pages() -> Iterator[tuple[Path, str]]:
    """Yield the file and the text of each page."""
    for name in presented("tasks"):
        yield PAGES / f"{name}.md", page(load_task(name))


def page(task: Task) -> str:
    """Return the page of a task, in Markdown."""
    intro, told = docstring_parts(task)
    notes = NOTES / f"{task.name}.md"
    parts = [
        f"# {task.name}",
        f"<!-- Made by docs/make_task_pages.py from tasks/{task.name}.py and notes/{task.name}.md: change those. -->",
        intro,
        _links(task),
        "## Action",
        told["Action space"],
        "The design:",
        _table(("entry", "low", "high", "unit", "node of the tool graph"), _design(task)),
        told["Design space"],
        "The control:",
        _table(("entry", "low", "high", "unit"), map(_cells, _entries(task.control_space))),
        "## Observation",
        told["Observation"],
        _table(("index", "entry", "low", "high", "unit"), _observation(task)),
        "## Goal",
        told["Goal space"],
        "The instance, which varies between episodes:",
        _table(("entry", "low", "high", "unit", "part"), _instance(task)),
        "## Reward",
        told["Reward"],
        _table(("term", "in every control step"), ((f"`{name}`", text) for name, text in task.reward_terms.items())),
        "## Episode",
        told["Starting state"],
        told["Episode end"],
        *_ends(task),
        "## Cutout and fine-tuning",
        *_cutout(task),
        "## Trade-off",
        _tradeoff(task),
        "## Physics",
        *_promises(task),
        "## Constants",
        _table(("constant", "value", "unit", "source", "meaning"), _constants(task)),
        _inside(notes.read_text(encoding="utf-8")) if notes.exists() else "",
    ]
    return "\n\n".join(part.strip("\n") for part in parts if part) + "\n"


def docstring_parts(task: Task) -> tuple[str, dict[str, str]]:
    """Return the introduction of a task's docstring, and its sections by their titles."""
    text = inspect.cleandoc(str(type(task).__doc__))
    first = SECTION.search(text)
    sections = {title: _paragraphs(body) for title, body in SECTION.findall(text)}
    return _paragraphs(text[: first.start()] if first else text), sections


def attribute_docs(statements: Sequence[ast.stmt]) -> dict[str, str]:
    """Return name -> the string after it, on one line, for the names that a module or class assigns."""
    found = {}
    for statement, after in pairwise(statements):
        target = statement.target if isinstance(statement, ast.AnnAssign) else None
        if isinstance(target, ast.Name) and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            found[target.id] = " ".join(str(after.value.value).split())
    return found


def number(value: Any, unit: str = "") -> str:
    """Return a bound or the value of a constant as text; angles also in degrees."""
    if isinstance(value, Box):
        entries = zip(value.names, value.low, value.high, strict=True)
        return ", ".join(f"{name} {number(low)} to {number(high)}" for name, low, high in entries)
    if isinstance(value, (tuple, np.ndarray)):
        return f"({', '.join(number(part) for part in value)})"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if unit == "rad" and value:
        return f"{value:.4g} ({np.rad2deg(value):.3g}°)"
    if unit == "s" and value < 0.1 and abs(1.0 / value - round(1.0 / value)) < 1e-9:
        return f"1/{round(1.0 / value)}"
    return f"{value:.6g}"


def _links(task: Task) -> str:
    own = f"tasks/{task.name}.py"
    shared = [f"tasks/{module}.py" for module in SIBLING.findall((ROOT / own).read_text(encoding="utf-8"))]
    code = ", ".join(f"[{path}](../../{path})" for path in (own, *shared, f"tasks/_scripts/{task.name}.py"))
    arm = " It can be [deployed](../deployment.md) on a simulated arm." if task.deployment else ""
    return f"Code: {code}. Gymnasium: `{environment_id(task.name)}`. *Ours* marks what the paper does not specify.{arm}"


def _entries(space: Box) -> Iterator[tuple[str, float, float, str]]:
    return zip(space.names, space.low, space.high, space.units, strict=True)


def _cells(entry: tuple[str, float, float, str]) -> tuple[str, str, str, str]:
    name, low, high, unit = entry
    return f"`{name}`", number(low, unit), number(high, unit), unit


def _design(task: Task) -> Iterator[tuple[str, ...]]:
    for entry, node in zip(_entries(task.design_space), task.tool_graph.parameter_nodes, strict=True):
        yield *_cells(entry), str(node)


def _observation(task: Task) -> Iterator[tuple[str, ...]]:
    layout = task.layout
    for part, space in ((layout.state, task.state_space), (layout.goal, task.goal_space)):
        start = part.start
        for _, alike in groupby(_entries(space), _series):
            entries = list(alike)
            stop = start + len(entries)
            if len(entries) < LONG:
                yield from (
                    (str(index), *_cells(entry)) for index, entry in zip(range(start, stop), entries, strict=True)
                )
            else:
                _, *bounds = _cells(entries[0])
                yield _span(slice(start, stop)), f"`{entries[0][0]}` to `{entries[-1][0]}`", *bounds
            start = stop
    yield _span(layout.design), "the design, normalised; 0 before the design step", "-1", "1", ""
    yield _span(layout.phase), ", ".join(f"`{name}`" for name in Layout.PHASE_NAMES), "0", "1", ""


def _series(entry: tuple[str, float, float, str]) -> tuple[str, float, float, str]:
    """Return what entries have in common whose names differ by a number at their end alone."""
    name, *bounds = entry
    return (name.rstrip("0123456789"), *bounds)


def _span(part: slice) -> str:
    return f"{part.start} to {part.stop - 1}"


def _instance(task: Task) -> Iterator[tuple[str, ...]]:
    for index, entry in enumerate(_entries(task.instance_space)):
        part = "goal" if index < task.goal_size else "not part of the goal"
        yield *_cells(entry), f"{part}, position" if entry[0] in task.position_entries else part


def _ends(task: Task) -> Iterator[str]:
    steps = f" for {task.success_steps} control steps in a row" if task.success_steps > 1 else ""
    yield f"*Success*: all of these hold{steps}."
    yield _table(("condition", "holds if"), ((f"`{name}`", text) for name, text in task.success_conditions.items()))
    if task.failure_condition:
        yield f"*Failure*: {task.failure_condition}."
    yield f"*Time limit*: {task.horizon} control steps of {number(task.control_period, 's')} s, after the design step."


def _cutout(task: Task) -> Iterator[str]:
    if not task.position_entries:
        yield "None: neither goals nor starts are positions."
        return
    text = _doc(type(task).in_cutout).replace("Return which", "`--cutout F` keeps out of training which", 1)
    yield textwrap.fill(
        text.replace("keeps out of training which", "leaves out the")
        .replace(" (b, I) are", "")
        .replace("`fraction`", "F"),
        WIDTH,
    )
    if type(task).fine_tuning_instances is not Task.fine_tuning_instances:
        told = re.sub(r"^Return [(][^)]*[)]: ", "", _doc(type(task).fine_tuning_instances))
        yield textwrap.fill(f"`--finetune N` fine-tunes a policy at one of {told}", WIDTH)
        rows = (map(number, place[0]) for place in task.fine_tuning_instances().tolist())
        yield _table(("`--finetune`", *task.instance_space.names), ((str(n + 1), *row) for n, row in enumerate(rows)))


def _tradeoff(task: Task) -> str:
    used = [
        re.sub(r",? for (designs|controls) \(b, [DC]\)[^.]*", "", _doc(method)).removeprefix("Return ").rstrip(".")
        for method in (type(task).material, type(task).effort)
    ]
    return textwrap.fill(f"With `--alpha A`, d_used / d_max is {used[0]}; c_used / c_max is {used[1]}.", WIDTH)


def _promises(task: Task) -> Iterator[str]:
    if task.outcome is not None:
        yield f"The outcome, independent of the reward: {task.outcome.name} ({task.outcome.unit})."
    if task.soundness is None:
        return
    tree = ast.parse(inspect.getsource(simulator))
    (own,) = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "Soundness")
    told = attribute_docs(own.body)
    yield "Guarantees of the physics, for any design and any control, checked by tests:"
    yield _table(
        ("promise", "limit", "meaning"), ((f"`{n}`", number(v), told[n]) for n, v in vars(task.soundness).items())
    )


def _constants(task: Task) -> Iterator[tuple[str, ...]]:
    own = ROOT / "tasks" / f"{task.name}.py"
    told: dict[str, str] = {}
    for path in (*sorted(own.parent.glob("_*.py")), own):  # the task's constants override shared ones
        told |= attribute_docs(ast.parse(path.read_text(encoding="utf-8")).body)
    for name, constant in task.scene.items():
        yield f"`{name}`", number(constant.value, constant.unit), constant.unit, constant.source, told[name]


def _table(header: Sequence[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(header), ["---"] * len(header), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _paragraphs(text: str) -> str:
    blocks = re.split(r"\n\s*\n", text.strip())
    return "\n\n".join(textwrap.fill(" ".join(block.split()), WIDTH, break_on_hyphens=False) for block in blocks)


def _doc(function: Any) -> str:
    return " ".join(inspect.cleandoc(str(function.__doc__)).split())


def _inside(notes: str) -> str:
    """Return the text of notes without their title, with links relative to the folder above."""
    return notes.split("\n", 1)[1].replace("](../", "](")


if __name__ == "__main__":
    sys.exit(main())
