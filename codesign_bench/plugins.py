"""Register the members that `--import` modules define, in this process and in the processes it starts."""

from __future__ import annotations

import importlib
import inspect
import os
from types import ModuleType

from codesign_bench.errors import UnavailableError, UserError, in_one_line
from codesign_bench.method import Method
from codesign_bench.registry import register
from codesign_bench.startup import IMPORTS_VARIABLE, imports_of, search_folder
from codesign_bench.study import Study
from codesign_bench.task import Task


def import_modules(modules: list[str]) -> None:
    """Import `modules` in this process and in every process it starts, and register what they define.

    Tasks and methods are classes, registered under their `name`. A study is the module's attribute `STUDY`. A module
    with `TITLE`, `data` and `draw` is a figure, registered under the last part of the module's name.

    A module that is nowhere else is searched in the working folder. Other modules are not, or a file of results named
    like a library could be executed.

    Raises:
        UserError: a module cannot be found.
        UnavailableError: it cannot be imported.
    """
    known, folder = imports_of(os.environ.get(IMPORTS_VARIABLE, ""))
    wanted = list(dict.fromkeys([*known, *modules]))
    finder = search_folder(folder or os.getcwd(), wanted) if modules else None
    for name in wanted:
        _register_members(_imported(name))
    found_in = finder.folder if finder is not None and finder.used else folder
    os.environ[IMPORTS_VARIABLE] = ",".join(wanted) + (f"={found_in}" if found_in else "")


def _imported(name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and name.startswith(error.name):
            raise UserError(f"--import: no module named '{name}'") from error
        where = f"if it is in the working folder, give --import {error.name} first, or set PYTHONPATH"
        raise UnavailableError(f"it imports '{error.name}', which is not found; {where}", f"--import {name}") from error
    except (Exception, SystemExit) as error:
        raise UnavailableError(in_one_line(error), f"--import {name}") from error


def _is_meant_as_member(member: type, base: type) -> bool:
    """Return whether a class is a member, or one that lacks methods of `base`; a base of members has abstract ones."""
    lacks: frozenset[str] = getattr(member, "__abstractmethods__", frozenset())
    declared: frozenset[str] = getattr(base, "__abstractmethods__", frozenset())
    return not lacks or ("name" in vars(member) and lacks <= declared)


def _register_members(module: ModuleType) -> None:
    """Register the tasks, the methods, the study and the figure that a module defines (not those it imports)."""
    for member in vars(module).values():
        if not inspect.isclass(member) or member.__module__ != module.__name__:
            continue
        for group, base in (("tasks", Task), ("methods", Method)):
            if issubclass(member, base) and _is_meant_as_member(member, base):
                register(group, member.name, lambda member=member: member)  # type: ignore[misc]
    if isinstance(getattr(module, "STUDY", None), Study):
        register("studies", module.STUDY.name, lambda: module)
    if all(hasattr(module, name) for name in ("TITLE", "data", "draw")):
        register("paper_figs", module.__name__.rpartition(".")[2], lambda: module)
