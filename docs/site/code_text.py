"""What a module defines, read from its text."""

from __future__ import annotations

import ast
from pathlib import Path


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
