"""Find tasks, methods, figures and studies: files in the group's folder, entry points of packages, `--import`.

Listing names imports no member, so it needs neither torch nor pybullet.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache, partial
from importlib.metadata import EntryPoint, entry_points
from types import GenericAlias, ModuleType
from typing import Any

from codesign_bench.errors import UnavailableError, UserError, in_one_line, unknown_name
from codesign_bench.startup import IMPORTS_VARIABLE as IMPORTS_VARIABLE  # a part of this module, too

KINDS = {"methods": "method", "tasks": "task", "paper_figs": "figure", "studies": "study"}
"""The groups of members, and the singular that messages use for each."""

_registered: dict[str, dict[str, Callable[[], Any]]] = {}


def register(group: str, name: str, loader: Callable[[], Any]) -> None:
    """Add the entry `name` to `group` (one of `KINDS`), for `--import`; `loader` returns its class or module."""
    _registered.setdefault(group, {})[name] = loader


def names(group: str) -> tuple[str, ...]:
    """Return all names in `group` (one of `KINDS`): built-in files, then entry points, then `--import`."""
    return tuple(dict.fromkeys((*_files(group), *sorted(_entry_points(group)), *sorted(_registered.get(group, {})))))


def built_in(group: str) -> tuple[str, ...]:
    """Return the names in `group` that come with codesign-bench: the files in its folder."""
    return _files(group)


def presented(group: str) -> tuple[str, ...]:
    """Return the built-in names of `group` that its folder's `ORDER` lists: those with a page in the documentation."""
    return _order(group)


def in_order(group: str, found: Iterable[str]) -> list[str]:
    """Return the unique names in `found` in the order of `names(group)`; unknown names last, sorted."""
    present, known = set(found), names(group)
    return [name for name in known if name in present] + sorted(present - set(known))


def load(group: str, name: str, base: type) -> Any:
    """Return the public subclass of `base` that the entry `name` of `group` defines.

    Raises:
        UserError: no entry has this name.
        UnavailableError: it cannot be imported in this Python.
        TypeError: its file does not define exactly one public subclass of `base`.
    """
    found = _entry(group, name)
    return single_subclass(found, base) if isinstance(found, ModuleType) else found


def usable(given: Iterable[str], load_one: Callable[[str], object], log: Callable[[str], None]) -> list[str]:
    """Return those of the given names that `load_one` can load in this Python; log the others, a line per reason."""
    left_out: dict[str, list[str]] = {}
    found = []
    for name in given:
        try:
            load_one(name)
            found.append(name)
        except UnavailableError as error:
            left_out.setdefault(error.reason, []).append(name)
    for reason, left in left_out.items():
        log(f"left out: {', '.join(left)}: {reason}")
    return found


def usable_modules(group: str, log: Callable[[str], None] = lambda line: None) -> list[str]:
    """Return the names in `group`, figures or studies, that can be imported; log the others, a line per reason."""
    return usable(names(group), partial(load_module, group), log)


def load_module(group: str, name: str) -> ModuleType:
    """Return the module of the entry `name` of `group` (figures and studies are modules, not classes).

    Raises:
        UserError: no entry has this name.
        UnavailableError: it cannot be imported in this Python.
        TypeError: the entry is not a module.
    """
    found = _entry(group, name)
    if not isinstance(found, ModuleType):
        raise TypeError(f"the {KINDS[group]} '{name}' must be a module, not {type(found).__name__}")
    return found


def load_attribute(group: str, name: str, attribute: str) -> Any:
    """Return an attribute of the module of the entry `name` of `group`.

    Raises:
        UserError: no entry has this name, or the package that adds it cannot be imported.
        TypeError: its module lacks the attribute.
    """
    module = load_module(group, name)
    if not hasattr(module, attribute):
        raise TypeError(f"{module.__name__} is registered as a {KINDS[group]} and must define {attribute}")
    return getattr(module, attribute)


def load_all(group: str, attribute: str) -> Iterator[tuple[str, Any]]:
    """Yield each name of `group` with an attribute of its module; what cannot be loaded is left out.

    Nobody asked for those by name, so a faulty package must not end what does not need it; `list` tells what is wrong.
    """
    for name in names(group):
        try:
            found = load_attribute(group, name, attribute)
        except (UserError, TypeError):
            if name in _files(group):
                raise
            continue
        yield name, found


def single_subclass(module: ModuleType, base: type) -> Any:
    """Return the public subclass of `base` that `module` defines (not one that it imports).

    Raises:
        TypeError: `module` does not define exactly one.
    """
    found = [
        member
        for name, member in inspect.getmembers(module, inspect.isclass)
        if not isinstance(member, GenericAlias)  # an alias of a generic type, which Python 3.10 takes for a class
        if issubclass(member, base) and member.__module__ == module.__name__ and not name.startswith("_")
    ]
    if len(found) != 1:
        raise TypeError(f"{module.__name__} must define one public {base.__name__}, not {len(found)}")
    return found[0]


def _entry(group: str, name: str) -> Any:
    """Return what the entry `name` of `group` names: a module, a class, or whatever an entry point names."""
    if name in _files(group):
        load: Callable[[], Any] = partial(importlib.import_module, f"codesign_bench.{group}.{name}")
    elif name in _entry_points(group):
        load = _entry_points(group)[name].load
    elif name in _registered.get(group, {}):
        load = _registered[group][name]
    else:
        raise unknown_name(KINDS[group], name, names(group))
    try:
        return load()
    except UnavailableError as error:
        raise UnavailableError(error.reason, f"{KINDS[group]} '{name}'") from error
    except (Exception, SystemExit) as error:
        lacking = isinstance(error, ImportError) and (error.name or "").partition(".")[0] != "codesign_bench"
        if name in _files(group) and not lacking:
            raise  # a fault of our own
        raise UnavailableError(_reason(error), f"{KINDS[group]} '{name}'") from error


def _reason(error: BaseException) -> str:
    """Return in one line why an import failed."""
    if isinstance(error, ModuleNotFoundError) and error.name:
        return f"it needs {error.name.partition('.')[0]}, which is not installed"
    return " ".join(str(error).split()) if isinstance(error, ImportError) else in_one_line(error)


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
