"""Find tasks, methods and figures: a file in the folder is an entry, and so is an installed package's entry point.

Names are listed without importing anything, so that listing needs neither torch nor pybullet.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any

from codesign_bench.errors import unknown_name

IMPORTS_VARIABLE = "CODESIGN_BENCH_IMPORTS"
"""Environment variable through which `--import module` reaches the worker processes (module names, comma-separated)."""

_registered: dict[str, dict[str, Callable[[], Any]]] = {}


def register(group: str, name: str, loader: Callable[[], Any]) -> None:
    """Add the entry `name` to `group` ("methods" or "tasks"); `loader` returns its class. For `--import`."""
    _registered.setdefault(group, {})[name] = loader


def names(group: str) -> tuple[str, ...]:
    """Return every name in `group` ("methods", "tasks" or "paper_figs"): built-in files, entry points, `--import`."""
    return tuple(dict.fromkeys((*_files(group), *sorted(_entry_points(group)), *sorted(_registered.get(group, {})))))


def load(group: str, name: str, base: type) -> Any:
    """Return the one public subclass of `base` that the entry `name` of `group` defines.

    Raises:
        UserError: there is no such entry.
        TypeError: its file does not define exactly one such class.
    """
    if name in _files(group):
        return single_subclass(importlib.import_module(f"codesign_bench.{group}.{name}"), base)
    if name in _entry_points(group):
        loaded = _entry_points(group)[name].load()
        return single_subclass(loaded, base) if isinstance(loaded, ModuleType) else loaded
    if name in _registered.get(group, {}):
        return _registered[group][name]()
    raise unknown_name(group.rstrip("s").replace("paper_fig", "figure"), name, names(group))


def load_module(group: str, name: str) -> ModuleType:
    """Return the module of the built-in entry `name` of `group` (figures are modules, not classes).

    Raises:
        UserError: there is no such entry.
    """
    if name not in _files(group):
        raise unknown_name("figure" if group == "paper_figs" else group.rstrip("s"), name, _files(group))
    return importlib.import_module(f"codesign_bench.{group}.{name}")


def single_subclass(module: ModuleType, base: type) -> Any:
    """Return the one public class that `module` itself defines below `base`.

    Raises:
        TypeError: there is none, or more than one.
    """
    found = [
        member
        for name, member in inspect.getmembers(module, inspect.isclass)
        if issubclass(member, base) and member.__module__ == module.__name__ and not name.startswith("_")
    ]
    if len(found) != 1:
        raise TypeError(f"{module.__name__} must define one public {base.__name__}, not {len(found)}")
    return found[0]


@lru_cache
def _files(group: str) -> tuple[str, ...]:
    package = importlib.import_module(f"codesign_bench.{group}")
    found = [info.name for info in pkgutil.iter_modules(package.__path__) if not info.name.startswith("_")]
    order: tuple[str, ...] = getattr(package, "ORDER", ())
    return tuple(sorted(found, key=lambda name: (order.index(name) if name in order else len(order), name)))


def _entry_points(group: str) -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=f"codesign_bench.{group}")}
