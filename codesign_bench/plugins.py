"""Members that a module named by `--import` defines, here and in every process started from here."""

from __future__ import annotations

import importlib
import inspect
import os

from codesign_bench.errors import UserError
from codesign_bench.method import Method
from codesign_bench.registry import IMPORTS_VARIABLE, register
from codesign_bench.task import Task


def import_modules(modules: list[str]) -> None:
    """Import `modules` here and in every process started from here, so that they can `register` their entries.

    Raises:
        UserError: a module cannot be found.
    """
    known = [name for name in os.environ.get(IMPORTS_VARIABLE, "").split(",") if name]
    for name in known + [name for name in modules if name not in known]:
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as error:
            if error.name is None or not name.startswith(error.name):
                raise
            raise UserError(f"--import: no module named '{name}'") from error
        _register_classes(name)
    os.environ[IMPORTS_VARIABLE] = ",".join(dict.fromkeys(known + modules))


def _register_classes(module_name: str) -> None:
    """Register the tasks and methods that an imported module defines, under the names that they give themselves."""
    module = importlib.import_module(module_name)
    for member in vars(module).values():
        if not inspect.isclass(member) or inspect.isabstract(member) or member.__module__ != module.__name__:
            continue
        for group, base in (("tasks", Task), ("methods", Method)):
            if issubclass(member, base):
                register(group, member.name, lambda member=member: member)  # type: ignore[misc]
