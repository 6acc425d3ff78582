"""The reference of the code: a page for each package, from its docstrings."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from assemble import ROOT
from code_text import public
from codesign_bench.registry import built_in
from fragments import first_sentence, table, toctree

FLAT = ("tasks", "methods", "paper_figs")


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
