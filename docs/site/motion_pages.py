"""The animations of the gallery, on its page and on others."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterable
from typing import Any

from assemble import Site
from codesign_bench.method import method_names
from codesign_bench.registry import built_in
from codesign_bench.study import DEFAULT_STUDY, load_study
from codesign_bench.task import load_task
from fragments import first_sentence, lowered
from gallery import GALLERY, RECORD, SCRIPT


def entries() -> list[dict[str, Any]]:
    """Return the records of the gallery's pictures."""
    return json.loads((GALLERY / RECORD).read_text(encoding="utf-8"))


def picture(entry: dict[str, Any], caption: str) -> str:
    """Return a figure with an animation of the gallery."""
    task, method = entry["task"], entry["method"]
    return (
        f":::{{figure}} {{gallery}}{task}_{method}.gif\n"
        f":alt: Animation of {method} on {task}, two episodes side by side; {outcome(entry)}.\n\n{caption}\n:::\n"
    )


def in_motion(task: str) -> str:
    """Return the animation of a task's first method for the task's page, or nothing."""
    found = [entry for entry in entries() if entry["task"] == task]
    by_method = {entry["method"]: entry for entry in found}
    shown = [by_method[method] for method in (*method_names(), SCRIPT) if method in by_method][:1]
    return "".join(
        cards(
            [picture(one, f"{one['method']}: {outcome(one)}.{former(one)} More in the {{doc}}`gallery </gallery>`.")],
            "../",
        )
        for one in shown
    )


def outcome(entry: dict[str, Any]) -> str:
    """Return in words which of the episodes shown ended in success."""
    words = ["solved" if solved else "not solved" for solved in entry["solved"]]
    return f"left {words[0]}, right {words[1]}"


def former(entry: dict[str, Any]) -> str:
    """Return a remark on a picture of an earlier version of a task, or nothing."""
    shown, now = entry["task_version"], load_task(entry["task"]).version
    return f" Version {shown} of the task, which is now at version {now}." if shown != now else ""


def cards(lines: Iterable[str], up: str = "") -> str:
    """Return figures as a grid; `up` leads from the page to the site's root."""
    figures = "\n".join(lines).replace("{gallery}", f"{up}files/docs/images/gallery/")
    return f"::::{{container}} cards\n{figures}::::\n"


def copy_gallery(site: Site) -> None:
    for entry in entries():
        site.link(f"docs/images/gallery/{entry['task']}_{entry['method']}.gif", "README.md", "index.md")


def tasks_in_motion(up: str = "") -> str:
    """Return an animation of every task, played by the first method of the default study that has one, with a link."""
    order = {method: index for index, method in enumerate(load_study(DEFAULT_STUDY).methods)}
    figures = []
    for task in built_in("tasks"):
        found = sorted((e for e in entries() if e["task"] == task), key=lambda e: order.get(e["method"], len(order)))
        caption = f"[{load_task(task).title}](docs/tasks/{task}.md): {lowered(asked(task))}"
        figures.append(picture(found[0], f"{caption}{former(found[0])}") if found else f"{caption}\n")
    return cards(figures, up)


def asked(task: str) -> str:
    """Return the first sentence of a task, without where in the paper it is."""
    return re.sub(r" \(paper[^)]*\)", "", first_sentence(doc_of_task(task)))


def doc_of_task(name: str) -> str:
    """Return the docstring of a task's class."""
    return inspect.getdoc(type(load_task(name))) or ""


def gallery() -> str:
    """Return the page with a picture for every task and method."""
    parts = [
        "# Gallery",
        "The final policy of the first seed on the first two evaluation instances of each task, whatever comes of "
        "them. The left and the right half are two episodes with different goals: a method that designs a tool for "
        "each goal shows two tools, the others show the same tool twice. Policies of the "
        "paper's methods on its tasks are from the [reference results](results/reference/README.md), the others from "
        "the [results of all methods](results/all_methods/README.md).",
    ]
    for task in built_in("tasks"):
        found = {entry["method"]: entry for entry in entries() if entry["task"] == task}
        parts.append(f"## {load_task(task).title}\n\n[{task}](docs/tasks/{task}.md): {lowered(asked(task))}")
        if set(found) <= {SCRIPT}:
            caption = "No policy of this task is shipped yet; its script plays."
            parts.append(cards(picture(entry, caption) for entry in found.values()) if found else caption)
            continue
        if note := former(next(iter(found.values()))):
            parts.append(f"Shown: {lowered(note.strip())}")
        order = [method for method in method_names() if method in found]
        parts.append(cards(picture(found[m], f"[{m}](docs/methods/{m}.md): {outcome(found[m])}.") for m in order))
    return "\n\n".join(parts) + "\n"
