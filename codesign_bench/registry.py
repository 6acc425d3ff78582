"""Find tasks, methods, figures and studies: a file in the folder is an entry, as is a package's entry point.

Names are listed without importing anything, so that listing needs neither torch nor pybullet.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterable
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any

from codesign_bench.errors import unknown_name

IMPORTS_VARIABLE = "CODESIGN_BENCH_IMPORTS"
"""Environment variable through which `--import module` reaches the worker processes (module names, comma-separated)."""

KINDS = {"methods": "method", "tasks": "task", "paper_figs": "figure", "studies": "study"}
"""Groups of members, and what one of each is called."""

_registered: dict[str, dict[str, Callable[[], Any]]] = {}


def register(group: str, name: str, loader: Callable[[], Any]) -> None:
    """Add the entry `name` to `group` (one of `KINDS`); `loader` returns its class or module. For `--import`."""
    _registered.setdefault(group, {})[name] = loader


def names(group: str) -> tuple[str, ...]:
    """Return every name in `group` (one of `KINDS`): built-in files, entry points, `--import`."""
    return tuple(dict.fromkeys((*_files(group), *sorted(_entry_points(group)), *sorted(_registered.get(group, {})))))


def built_in(group: str) -> tuple[str, ...]:
    """Return the names in `group` that come with codesign-bench: the files of its folder."""
    return _files(group)


def presented(group: str) -> tuple[str, ...]:
    """Return the built-in names of `group` that its folder's `ORDER` lists: those with a page in the documentation."""
    return _order(group)


def in_order(group: str, found: Iterable[str]) -> list[str]:
    """Return the `found` names of `group`, each once, in the order of listings; unknown ones last, by name."""
    present, known = set(found), names(group)
    return [name for name in known if name in present] + sorted(present - set(known))


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
    raise unknown_name(KINDS[group], name, names(group))


def load_module(group: str, name: str) -> ModuleType:
    """Return the module of the entry `name` of `group` (figures and studies are modules, not classes).

    Raises:
        UserError: there is no such entry.
        TypeError: it is something else than a module.
    """
    if name in _files(group):
        return importlib.import_module(f"codesign_bench.{group}.{name}")
    if name in _entry_points(group):
        found = _entry_points(group)[name].load()
    elif name in _registered.get(group, {}):
        found = _registered[group][name]()
    else:
        raise unknown_name(KINDS[group], name, names(group))
    if not isinstance(found, ModuleType):
        raise TypeError(f"the {KINDS[group]} '{name}' must be a module, not {type(found).__name__}")
    return found


def load_attribute(group: str, name: str, attribute: str) -> Any:
    """Return what the module of the entry `name` of `group` calls `attribute`.

    Raises:
        UserError: there is no such entry.
        TypeError: its module has no such attribute.
    """
    module = load_module(group, name)
    if not hasattr(module, attribute):
        raise TypeError(f"{module.__name__} is registered as a {KINDS[group]} and must define {attribute}")
    return getattr(module, attribute)


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
    order = _order(group)
    return tuple(sorted(found, key=lambda name: (order.index(name) if name in order else len(order), name)))


def _order(group: str) -> tuple[str, ...]:
    package = importlib.import_module(f"codesign_bench.{group}")
    return tuple(getattr(package, "ORDER", ()))


def _entry_points(group: str) -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=f"codesign_bench.{group}")}
