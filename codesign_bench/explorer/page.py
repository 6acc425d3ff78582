"""Write the explorer: one page with all data, styles and scripts, which needs no other file and no network."""

from __future__ import annotations

import json
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import jinja2

from codesign_bench.code_version import code_version
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.storage.files import make_folder, removed_if_refused, write_output
from codesign_bench.visible_text import visible

from .gather import Choice, chosen_cells, task_data

ENDINGS = (".html", ".htm")
TEMPLATE = "page.html.j2"
PLACE_OF_DATA = "{the data of this page}"
MOST_BYTES = 10_000_000
"""Largest size of a page."""


def write_explorer(results: Path, out: Path, log: Log, choice: Choice | None = None) -> None:
    """Write the page on the chosen cells of `results` to the file `out`, and log its path and size.

    Args:
        results: a results folder.
        out: an HTML file.
        log: prints lines: what is left out, progress, the path.
        choice: the cells; None: all of the default variant.

    Raises:
        UserError: there is no cell to show, the page would be larger than 10 MB, or `out` is not writable.
    """
    if out.suffix.lower() not in ENDINGS:
        raise UserError(f"--out {out}: the file must end in {ENDINGS[0]}")
    choice = choice or Choice()
    cells = chosen_cells(results, choice, log)
    count = sum(map(len, cells.values()))
    with removed_if_refused(out.parent):
        make_folder(f"--out {out}", out.parent)
        tasks = []
        for name, of_task in cells.items():
            tasks.append(task_data(name, of_task, choice.goals, log))
            check_size(sum(map(len, map(_json, tasks))), sum(len(task["cells"]) for task in tasks), count)
        page = render(tasks, results.name)
        check_size(len(page.encode()), count, count)
        write_output(f"--out {out}", out, page)
    log(f"{out}: {_megabytes(len(page))}, {count} cells")


def check_size(size: int, shown: int, cells: int) -> None:
    """Check that a page of `size` bytes, which shows `shown` of `cells` cells so far, is no larger than allowed.

    Raises:
        UserError: it is larger; says which options make it smaller.
    """
    if size > MOST_BYTES:
        raise UserError(
            f"explore: the page would be larger than {_megabytes(MOST_BYTES)}: {_megabytes(size)} with {shown} of "
            f"{cells} cells; choose fewer with --task, --method or --seeds, or fewer goals with --goals"
        )


def render(tasks: list[dict[str, Any]], results: str) -> str:
    """Return the page as HTML.

    Args:
        tasks: from `task_data`.
        results: name of the results.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("codesign_bench.explorer"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(TEMPLATE).render(
        data=PLACE_OF_DATA,
        results=results,
        tasks=tasks,
        made=datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        code=str(code_version()),
    )
    # The data are plain ASCII, and long: looking at each of their characters would take seconds.
    return visible(page).replace(PLACE_OF_DATA, _json({"results": visible(results), "tasks": tasks}))


def _json(values: Any) -> str:
    """Return JSON that can be put into a page's script element: no character of it can end or open an element."""
    text = json.dumps(values, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
