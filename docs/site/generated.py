"""The pages and parts of pages that are made from the registry, the shipped results and the code.

Everything here follows what is registered and what lies in the results folders: a new task, method or study appears on
the site without a change.
"""

from __future__ import annotations

import ast
import csv
import inspect
import json
import re
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from assemble import ROOT, Site, title_of
from codesign_bench.claims.finding import VERDICTS
from codesign_bench.method import load_method, method_names
from codesign_bench.registry import built_in, load_module
from codesign_bench.study import DEFAULT_STUDY, Study, load_study
from codesign_bench.task import load_task
from gallery import GALLERY, RECORD, SCRIPT

RESULTS = ROOT / "results"
REFERENCE = RESULTS / "reference"
EXPLORED = RESULTS / "all_methods"
"""What the explorer shows: policies on the present version of every task."""
EXPLORER = "explore.html"
"""Where the explorer lies on the site."""
INSERT = re.compile(r"^<!-- insert: (\w+) -->$", re.MULTILINE)
"""Where a hand-written page takes a generated part."""
CODE = re.compile(r"^<!-- code: (\S+) (\w+) -->$", re.MULTILINE)
"""Where it takes the lines of a file that define a name."""
FLAT = ("tasks", "methods", "paper_figs")


def completed(name: str, text: str) -> str:
    """Return a page of the repository with its generated parts, and with the tables of contents that the site needs."""
    text = INSERT.sub(lambda found: in_links_of(name, INSERTS[found[1]]()), text)
    if name.startswith("docs/tasks/"):
        text = text.replace("\n## ", f"\n{in_motion(Path(name).stem)}\n## ", 1)
    text = CODE.sub(lambda found: f"```python\n{definition(ROOT / found[1], found[2])}\n```", text)
    return text + toctree(CHILDREN[name]()) if name in CHILDREN else text


def write(site: Site) -> None:
    """Write every generated page."""
    _copy_gallery(site)
    for place, text in [
        ("gallery.md", gallery()),
        ("tasks/index.md", tasks()),
        ("methods/index.md", methods()),
        ("studies/index.md", studies()),
        *((f"studies/{name}.md", study_page(load_study(name))) for name in built_in("studies")),
    ]:
        site.add(place, text, "README.md")
    for place, text in api():
        site.write(place, text)


def in_links_of(name: str, text: str) -> str:
    """Return a generated part, whose links lead from the repository's root, for a page in a folder below it."""
    up = "../" * (len(Path(name).parts) - 1)
    return re.sub(r"\]\((?=\w[^)]*\))(?!\w+:)", f"]({up}", text)


def definition(path: Path, name: str) -> str:
    """Return the lines of a file that define a class, a function or a value at its top level.

    Raises:
        ValueError: nothing there has this name.
    """
    source = path.read_text(encoding="utf-8")
    for node in ast.parse(source).body:
        if name in names_of(node):
            return ast.get_source_segment(source, node) or ""
    raise ValueError(f"{path} defines no {name}")


def names_of(node: ast.stmt) -> list[str]:
    """Return the names that a statement defines."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [getattr(node, "name", ""), *(one.id for one in targets if isinstance(one, ast.Name))]


def public(path: Path) -> list[str]:
    """Return the public classes and functions that a module defines, and the values that a docstring follows."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    found = []
    for node, after in zip(body, [*body[1:], None], strict=True):
        documented = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        if documented or isinstance(node, ast.ClassDef | ast.FunctionDef):
            found += [name for name in names_of(node) if name and not name.startswith("_")]
    return list(dict.fromkeys(found))


def toctree(entries: Iterable[str]) -> str:
    """Return a hidden table of contents; it gives the sidebar its order."""
    return "\n```{toctree}\n:hidden:\n\n" + "\n".join(entries) + "\n```\n"


def _handbook() -> list[str]:
    """Return the pages directly under docs/, in the order in which the index names them, then the others."""
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    named = re.findall(r"\]\((\w+)\.md\)", index)
    others = sorted(path.stem for path in (ROOT / "docs").glob("*.md") if path.stem != "index")
    return list(dict.fromkeys([*(name for name in named if name in others), *others]))


def _results() -> list[str]:
    folders = sorted(path.parent.name for path in RESULTS.glob("*/README.md"))
    return ["reference", *(name for name in folders if name != "reference"), "tuning"]


CHILDREN: dict[str, Callable[[], list[str]]] = {"docs/index.md": _handbook, "results/README.md": _results}
"""Page of the repository -> the pages below it in the sidebar."""


# Pictures


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


def _copy_gallery(site: Site) -> None:
    for entry in entries():
        site.link(f"docs/images/gallery/{entry['task']}_{entry['method']}.gif", "README.md", "index.md")


def first_sentence(text: str) -> str:
    """Return the first sentence of a docstring, on one line."""
    line = " ".join(inspect.cleandoc(text).split("\n\n")[0].split())
    return re.split(r"(?<=[a-z0-9)\]\"]\.)(?<!et al\.)\s", line, maxsplit=1)[0]


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


def lowered(sentence: str) -> str:
    """Return a sentence that goes on after a colon."""
    return sentence[0].lower() + sentence[1:]


def doc_of_task(name: str) -> str:
    """Return the docstring of a task's class."""
    return inspect.getdoc(type(load_task(name))) or ""


def gallery() -> str:
    """Return the page with a picture for every task and method."""
    parts = [
        "# Gallery",
        "The final policy of the first seed on the first two evaluation instances of each task, whatever comes of "
        "them. The left and the right half are two episodes with different goals: a method that designs a tool for "
        "each goal shows two tools, the others show the same tool twice. Policies are from the "
        "[shipped results](results/reference/README.md).",
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


# Tasks and methods


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
    with (REFERENCE / "figures" / "final_results.csv").open(encoding="utf-8") as file:
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


def table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table in Markdown."""
    lines = [list(header), *(list(row) for row in rows)]
    text = [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines]
    return "\n".join([text[0], "|" + " --- |" * len(lines[0]), *text[1:]])


# Studies


def shipped(study: Study) -> list[Path]:
    """Return the results folders whose verdicts are on the claims of a study."""
    found = sorted(RESULTS.glob("*/claims/claims.json"))
    return [path.parents[1] for path in found if json.loads(path.read_text(encoding="utf-8"))["study"] == study.name]


def studies() -> str:
    """Return the page that lists the studies with the numbers of their verdicts."""
    rows = []
    for name in built_in("studies"):
        study = load_study(name)
        rows.append((f"[{name}](/studies/{name}.md)", study.title, study.source, verdicts(study)))
    lead = (
        "A [study](docs/experiments.md) asks one question and describes as data what the answer needs: experiments, "
        "figures and claims. Each claim is judged by a [rule](docs/claims.md) that was written down before the results."
    )
    listing = table(("study", "title", "source", "verdicts"), rows)
    return f"# Studies\n\n{lead}\n\n{listing}\n" + toctree(built_in("studies"))


PARTS = {"claims": "claims", "checks_of_scenes": "checks of scenes"}
"""Part of `claims.json` -> what its entries are called."""


def verdicts(study: Study) -> str:
    """Return how many claims of a study got which verdict, checks of scenes apart; or that nothing is shipped."""
    outcomes = []
    for folder in shipped(study):
        judged = json.loads((folder / "claims" / "claims.json").read_text(encoding="utf-8"))
        for part, label in PARTS.items():
            counts = [f"{number} {v}" for v in VERDICTS if (number := sum(c["verdict"] == v for c in judged[part]))]
            outcomes += [f"{len(judged[part])} {label}: {', '.join(counts)}"] if judged[part] else []
    return "; ".join(outcomes) or "no results yet"


def study_page(study: Study) -> str:
    """Return a study's page: question, experiments, and for shipped results verdicts, figures and every claim."""
    experiments = [
        (f"`{name}`", ", ".join(f"`{figure}`" for figure in one.figures), one.source)
        for name, one in study.experiments.items()
    ]
    parts = [
        f"# {study.title}",
        study.question,
        f"Source: {study.source}. Methods: {', '.join(f'[{m}](docs/methods/{m}.md)' for m in study.methods)}.",
        f"```\ncodesign-bench reproduce --study {study.name}\n```",
        f"## Experiments\n\n{table(('experiment', 'figures', 'source'), experiments)}",
    ]
    folders = shipped(study)
    if not folders:
        parts.append("## Verdicts\n\nNo results of this study are shipped yet, so no claim is judged.")
    for folder in folders:
        name = folder.relative_to(ROOT).as_posix()
        parts += [
            f"## Verdicts\n\n[{name}]({name}/README.md) says how these results were made, and which verdicts do "
            "not count any more. Read it before you use a number from here.",
            claims_of(folder),
            f"## Figures\n\n{figures_of(study, folder)}",
        ]
    return "\n\n".join(parts) + "\n"


def claims_of(folder: Path) -> str:
    """Return what `verify` wrote about the claims, one level down, without its title."""
    text = (folder / "claims" / "claims.md").read_text(encoding="utf-8").split("\n", 1)[1].strip()
    return re.sub(r"^## ", "### ", text, flags=re.MULTILINE)


def figures_of(study: Study, folder: Path) -> str:
    """Return the study's shipped figures, each with its caption and a link to its numbers."""
    parts = []
    for name in study.figures:
        path = folder / "figures" / f"{name}.png"
        if not path.exists():
            continue
        module = load_module("paper_figs", name)
        doc = " ".join((inspect.getdoc(module) or "").split("\n\n")[0].split())
        place = path.relative_to(ROOT).as_posix()
        numbers = f" [Numbers]({place.removesuffix('.png')}.csv)." if path.with_suffix(".csv").exists() else ""
        parts.append(f"### {module.TITLE}\n\n[![{module.TITLE}: {plain(doc)}]({place})]({place})\n\n{doc}{numbers}")
    return "\n\n".join(parts)


def plain(text: str) -> str:
    """Return a text that can be an alternative text in Markdown."""
    return re.sub(r"[`\[\]*_]", lambda found: "" if found[0] != "_" else "_", text)


# Reference of the code


def api() -> Iterator[tuple[str, str]]:
    """Yield every page of the API reference: the package's own names, then one page for each of its rooms."""
    core = ROOT / "codesign_bench"
    rooms = sorted(path.name for path in core.iterdir() if (path / "__init__.py").exists())
    listed = [*rooms, *FLAT]
    yield "api/index.md", _api_index(listed)
    for room in rooms:
        yield f"api/{room}.md", _room(f"codesign_bench.{room}", sorted((core / room).rglob("*.py")), core)
    for room in FLAT:
        files = [ROOT / room / f"{name}.py" for name in built_in(room)]
        yield f"api/{room}.md", _room(f"codesign_bench.{room}", files, ROOT)
    alone = sorted(path for path in core.glob("*.py") if not path.stem.startswith("_"))
    yield "api/modules.md", _room("codesign_bench", alone, core, title="Single modules")


def _api_index(rooms: list[str]) -> str:
    package = import_module("codesign_bench")
    names = [name for name in package.__all__ if not name.startswith("_")]
    rows = [(f"[codesign_bench.{room}]({room}.md)", _summary(f"codesign_bench.{room}")) for room in rooms]
    docs = "\n".join(
        f".. auto{'exception' if inspect.isclass(getattr(package, name)) else 'function'}:: codesign_bench.{name}"
        for name in names
    )
    return (
        "# API reference\n\n`import codesign_bench as cb` gives the names that most programs need. They are resolved "
        f"on first use, so that the import is fast.\n\n```{{eval-rst}}\n{docs}\n```\n\n"
        f"## Everything else\n\n{table(('package', 'content'), rows)}\n" + toctree([*rooms, "modules"])
    )


def _summary(module: str) -> str:
    return first_sentence(inspect.getdoc(import_module(module)) or "")


def _room(package: str, files: list[Path], root: Path, title: str = "") -> str:
    """Return the page of a package: its docstring, the names that it gives on, and every public module."""
    parts = [f"# {title or package}"]
    if not title:
        parts.append(f"```{{eval-rst}}\n.. automodule:: {package}\n   :no-members:\n```")
        given = [name for name in getattr(import_module(package), "__all__", ()) if not name.startswith("_")]
        if given:
            parts.append(f"`from {package} import ...`: {', '.join(f'`{name}`' for name in given)}.")
    for path in files:
        module = ".".join(("codesign_bench", *path.relative_to(root).with_suffix("").parts))
        if path.stem.startswith("_") or not _has_text(path):
            continue
        # Named one by one: what a module only imports is not looked at.
        members = f"   :members: {', '.join(names)}\n" if (names := public(path)) else ""
        parts.append(f"## {module}\n\n```{{eval-rst}}\n.. automodule:: {module}\n{members}```")
    return "\n\n".join(parts) + "\n"


def _has_text(path: Path) -> bool:
    return bool(ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))))


def explorer() -> str:
    """Return the explorer on shipped results, in a frame of its page and by itself."""
    return (
        "```{raw} html\n"
        f'<iframe class="explorer" src="{EXPLORER}" title="The explorer: drag the goal, see the tool" loading="lazy">'
        "</iframe>\n"
        f'<p><a href="{EXPLORER}">The explorer on a page of its own</a></p>\n'
        "```"
    )


INSERTS: dict[str, Callable[[], str]] = {"tasks": tasks_in_motion, "success": success, "explorer": explorer}
"""Name in `<!-- insert: NAME -->` -> the part."""
