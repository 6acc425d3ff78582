"""Checks of what a method declares: its name and label, its hyperparameters, and their values in every profile."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from codesign_bench.config.profiles import profiles
from codesign_bench.config.resolve import resolve
from codesign_bench.contract.check import Fault, counted, described, promised, undefined
from codesign_bench.contract.subject import Subject
from codesign_bench.errors import UnavailableError, UserError
from codesign_bench.method import Method, load_method, method_names, usable_methods
from codesign_bench.task import task_names, usable_tasks

METHOD = "codesign_bench.method.Method"
ELSEWHERE = "of somebody else"
"""Part of a name that no profile and no task has."""


@promised("It can be loaded, and everything that a method must define is there.", METHOD, first=True)
def loads(name: str) -> Iterator[Fault]:
    """Yield what keeps the method of this name from being used.

    Raises:
        UnavailableError: this Python lacks what it needs.
    """
    try:
        method_class = load_method(name)
    except UnavailableError:
        raise
    except Exception as error:
        yield Fault(f"loading it raised {described(error, None)}", "one public subclass of Method")
        return
    for attribute in undefined(method_class, Method):
        yield Fault(f"{method_class.__name__} has no `{attribute}`", "a value for every attribute that Method declares")
    if abstract := sorted(getattr(method_class, "__abstractmethods__", ())):
        yield Fault(f"{method_class.__name__} lacks: {', '.join(abstract)}", "every method that Method declares")
    if getattr(method_class, "name", name) != name:
        yield Fault(f"its name is '{method_class.name}'", f"'{name}', under which it is registered")


@promised("Its hyperparameters are a frozen dataclass with a default for each.", f"{METHOD}.config_class", first=True)
def hyperparameters_have_defaults(subject: Subject) -> Iterator[Fault]:
    """Yield what is missing."""
    config = subject.method_class.config_class
    # No public function tells whether a dataclass is frozen.
    if not dataclasses.is_dataclass(config) or not config.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        yield Fault(f"`config_class` is {config.__name__}", "a class with @dataclass(frozen=True)")
        return
    missing = dataclasses.MISSING
    bare = [field.name for field in dataclasses.fields(config) if field.default is field.default_factory is missing]
    if bare:
        yield Fault(f"no default: {counted(bare)}", "a default for every hyperparameter, which works on any task")
    if unknown := sorted(set(subject.method_class.small()) - {field.name for field in dataclasses.fields(config)}):
        yield Fault(f"`small` sets {', '.join(unknown)}", f"fields of {config.__name__}")


@promised("No other method has its label.", f"{METHOD}.label")
def label_is_its_own(subject: Subject) -> Iterator[Fault]:
    """Yield the methods with the same label."""
    labels = {name: load_method(name).label for name in usable_methods(method_names())}
    own = subject.method_class
    same = [name for name, label in labels.items() if label == own.label and name != own.name]
    if same:
        yield Fault(f"'{own.label}' is the label of {', '.join(same)}, too", "a label of its own for figures")


@promised("Every profile makes a valid configuration for every task.", f"{METHOD}.profile")
def profiles_are_valid(subject: Subject) -> Iterator[Fault]:
    """Yield profiles that set what is no hyperparameter, or a value that does not fit."""
    method_class = subject.method_class
    fields = {field.name for field in dataclasses.fields(method_class.config_class)}
    for profile in profiles():
        for task_name in usable_tasks(task_names()):
            try:
                parts = resolve(method_class, task_name, profile).stored().parts
            except (UserError, TypeError, ValueError) as error:
                yield Fault(f"profile '{profile}' on '{task_name}': {error}", "settings that are fields and fit them")
                continue
            bare = [name for settings in parts.values() for name, (_, source) in settings.items() if not source]
            if set(parts["method"]) != fields or bare:
                yield Fault(f"profile '{profile}' on '{task_name}' leaves without a source: {bare}", "(value, source)")
        if unknown := set(method_class.profile(profile, f"a task {ELSEWHERE}")) - fields:
            yield Fault(f"profile '{profile}' on an unknown task sets {unknown}", "general values")
    for task_name in usable_tasks(task_names())[:1]:
        if unknown := set(method_class.profile(f"a profile {ELSEWHERE}", task_name)) - fields:
            yield Fault(f"an unknown profile sets {unknown}", "general values")
