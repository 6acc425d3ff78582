"""Register the members that `--import` modules define, in this process and in the processes it starts."""

from __future__ import annotations

import importlib
import inspect
import os
from types import ModuleType

from codesign_bench.errors import UnavailableError, UserError
from codesign_bench.method import Method
from codesign_bench.registry import IMPORTS_VARIABLE, register
from codesign_bench.study import Study
from codesign_bench.task import Task


def import_modules(modules: list[str]) -> None:
    """Import `modules` in this process and in every process it starts, and register what they define.

    Tasks and methods are classes, registered under their `name`. A study is the module's attribute `STUDY`. A module
    with `TITLE`, `data` and `draw` is a figure, registered under the last part of the module's name.

    Raises:
        UserError: a module cannot be found.
        UnavailableError: a module imports a package that is not installed.
    """
    known = [name for name in os.environ.get(IMPORTS_VARIABLE, "").split(",") if name]
    for name in known + [name for name in modules if name not in known]:
        try:
            module = importlib.import_module(name)
        except ModuleNotFoundError as error:
            if error.name is None or not name.startswith(error.name):
                raise UnavailableError(f"it needs {error.name}, which is not installed", f"--import {name}") from error
            raise UserError(f"--import: no module named '{name}'") from error
        _register_members(module)
    os.environ[IMPORTS_VARIABLE] = ",".join(dict.fromkeys(known + modules))


def _register_members(module: ModuleType) -> None:
    """Register the tasks, the methods, the study and the figure that a module defines (not those it imports)."""
    for member in vars(module).values():
        if not inspect.isclass(member) or inspect.isabstract(member) or member.__module__ != module.__name__:
            continue
        for group, base in (("tasks", Task), ("methods", Method)):
            if issubclass(member, base):
                register(group, member.name, lambda member=member: member)  # type: ignore[misc]
    if isinstance(getattr(module, "STUDY", None), Study):
        register("studies", module.STUDY.name, lambda: module)
    if all(hasattr(module, name) for name in ("TITLE", "data", "draw")):
        register("paper_figs", module.__name__.rpartition(".")[2], lambda: module)
