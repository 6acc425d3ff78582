"""The source of a module and of the modules that it is made of, without what cannot change a number.

A member's own code is its module and all modules that this imports, directly or through others, from the same package,
or from the shared files of built-in tasks and methods. Code that other members of the package use alone is not part of
it. Imports are read from the source, so that the answer does not depend on what else a process has imported.
"""

from __future__ import annotations

import ast
import io
import sys
import sysconfig
import tokenize
from collections.abc import Iterator
from functools import cached_property
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path

CORE = "codesign_bench"
BUILT_IN = ("codesign_bench.tasks.", "codesign_bench.methods.")
"""Modules of built-in members, and the files that they share."""
FOR_PICTURES = ("script",)
"""Functions of a task that no training calls; what they alone import is not the task's own code."""

Import = tuple[str, tuple[str, ...]]
"""A module, and the names that are imported from it; none: the module itself, "*": all of its names."""


class SourceModule:
    """A module by its name; it is found, but not imported."""

    def __init__(self, name: str) -> None:
        self.name = name

    @cached_property
    def spec(self) -> ModuleSpec | None:
        """Where the module is; None: nowhere."""
        if getattr(sys.modules.get(self.name), "__spec__", None) is not None:
            return sys.modules[self.name].__spec__
        try:
            return find_spec(self.name)
        except (ImportError, ValueError, AttributeError):  # its parent is no package, or was made by hand
            return None

    @property
    def is_package(self) -> bool:
        """Whether it holds other modules."""
        return self.spec is not None and self.spec.submodule_search_locations is not None

    @property
    def file(self) -> Path | None:
        """The module's file, in the case of a package its `__init__.py`; None if it has none."""
        origin = None if self.spec is None or not self.spec.has_location else self.spec.origin
        return Path(origin) if origin else None

    @cached_property
    def content(self) -> bytes | None:
        """The content of its file, from an archive too; None if it cannot be read."""
        reader = getattr(self.spec and self.spec.loader, "get_data", None)
        if self.file is None or reader is None:
            return None
        try:
            data: bytes = reader(str(self.file))
        except OSError:
            return None
        return data[BYTECODE_HEADER:] if self.file.suffix == ".pyc" else data

    @cached_property
    def tree(self) -> ast.Module:
        """Its syntax tree; empty for what is not Python's source."""
        try:
            return ast.parse(self.content or b"")
        except (SyntaxError, ValueError):
            return ast.Module([], [])

    def imports(self) -> Iterator[Import]:
        """Yield what its source imports, except for type checkers and for pictures."""
        package = self.name if self.is_package else self.name.rpartition(".")[0]
        for node in _executed(self.tree):
            if isinstance(node, ast.Import):
                yield from ((alias.name, ()) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                parts = package.split(".") if node.level else []
                base = parts[: len(parts) - node.level + 1]
                module = ".".join([*base, *(node.module.split(".") if node.module else [])])
                if module:
                    yield module, tuple(alias.name for alias in node.names)

    def binding(self, name: str) -> str | None:
        """Return the module from which a package's `__init__.py` imports `name`, or None."""
        found = [module for module, wanted in self.imports() if name in wanted or "*" in wanted]
        return found[0] if found else None

    def stated(self, attribute: str) -> object:
        """Return the literal that a class of the module, or one that it extends, assigns to `attribute`; else None."""
        classes = [part for part in self.tree.body if isinstance(part, ast.ClassDef)]
        for node in (node for part in classes for node in part.body):
            if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Constant):
                continue
            if any(isinstance(target, ast.Name) and target.id == attribute for target in node.targets):
                return node.value.value
        bases = (base.value if isinstance(base, ast.Subscript) else base for part in classes for base in part.bases)
        modules = (self.binding(base.id) for base in bases if isinstance(base, ast.Name))
        found = (SourceModule(module).stated(attribute) for module in dict.fromkeys(modules) if module is not None)
        return next((value for value in found if value is not None), None)


BYTECODE_HEADER = 16
"""Bytes of a compiled module that hold the time of its source."""


def own_modules(module: str) -> list[SourceModule]:
    """Return the modules of a member's own code, beginning with `module`, the one that defines it."""
    first = SourceModule(module)
    found, left = {module: first}, [first]
    while left:
        for name in left.pop().imports():
            for other in _imported(*name):
                if other not in found and is_own(other, module):
                    found[other] = SourceModule(other)
                    left.append(found[other])
    return [one for one in found.values() if one.content is not None]


def is_own(module: str, member: str) -> bool:
    """Return whether a module that a member needs is part of its own code, given the module that defines the member."""
    if not _may_be_own(module):
        return False
    if f"{module}.".startswith(BUILT_IN):
        return True
    top, own = SourceModule(module.partition(".")[0]), SourceModule(member.partition(".")[0])
    if own.is_package or top.name == own.name:
        return top.name == own.name
    # The member is a single file: what lies beside it belongs to it, unless everything that is installed lies there.
    folder = None if own.file is None else own.file.parent
    locations = list((top.spec and top.spec.submodule_search_locations) or ())
    places = {Path(place).parent for place in locations} | ({top.file.parent} if top.file and not locations else set())
    return folder in places and str(folder) not in set(sysconfig.get_paths().values())


def essence(content: bytes) -> bytes:
    """Return Python source without comments, docstrings, blank lines and the system's kind of line ends.

    What is not Python's source comes back as it is.
    """
    try:
        tree = ast.parse(content)
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
        text = content.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
        lines = [bytearray(line.encode()) for line in text.removeprefix("\ufeff").split("\n")]
        for row, column in _comments("\n".join(line.decode() for line in lines)):
            del lines[row][len(lines[row].decode()[:column].encode()) :]
    except (SyntaxError, ValueError, tokenize.TokenError):
        return content
    for node in _texts(tree):
        _blank(lines, node)
    return b"\n".join(line for line in (bytes(line).rstrip() for line in lines) if line)


def _executed(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a tree that may run while a method trains on a task."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.FunctionDef) and node.name in FOR_PICTURES:
            continue
        yield node
        yield from _executed(node)


def _imported(module: str, names: tuple[str, ...]) -> Iterator[str]:
    """Yield the modules that `from module import names` is about; a package only passes most names on."""
    found = SourceModule(module)
    if not names or not found.is_package or not _may_be_own(module):
        yield module
        return
    for name in names:
        submodule = f"{module}.{name}"
        if SourceModule(submodule).spec is not None:
            yield submodule
        elif (source := found.binding(name)) is not None and source != module:
            yield from _imported(source, (name,))
        else:
            yield module


def _may_be_own(module: str) -> bool:
    return not f"{module}.".startswith(f"{CORE}.") or f"{module}.".startswith(BUILT_IN)


def _comments(text: str) -> Iterator[tuple[int, int]]:
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0] - 1, token.start[1]


def _texts(tree: ast.Module) -> Iterator[ast.Expr]:
    """Yield the statements that are only a text: docstrings, also those of attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node


def _blank(lines: list[bytearray], node: ast.Expr) -> None:
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    for row in range(node.lineno - 1, node.end_lineno):
        start = node.col_offset if row == node.lineno - 1 else 0
        stop = node.end_col_offset if row == node.end_lineno - 1 else len(lines[row])
        lines[row][start:stop] = b" " * (stop - start)
