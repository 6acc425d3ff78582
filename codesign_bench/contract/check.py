"""A check: one thing that is promised of a member, and a function that finds where the member breaks the promise."""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Generic, TypeVar

from codesign_bench.errors import in_one_line

MOST_FAULTS = 3
"""Faults that one check tells; the first of them usually causes the others."""
Member = TypeVar("Member")
Asked = TypeVar("Asked")


class DoesWithoutError(Exception):
    """A member does without an optional part, so a check has nothing to look at; the message names the part."""


@dataclass(frozen=True)
class Fault:
    """One place where a member breaks a promise."""

    found: str
    expected: str


@dataclass(frozen=True)
class Check(Generic[Member]):
    """One thing that is promised of every member of a kind."""

    promise: str
    """A sentence that is true of a sound member."""
    read: str
    """Full name of the class, function or attribute whose description has the details."""
    search: Callable[[Member], Iterator[Fault]]
    """Yields the faults of a member.

    Raises:
        DoesWithoutError: the member lacks an optional part that the check looks at.
    """
    first: bool = False
    """Whether no later check means anything where this one finds a fault."""

    @property
    def name(self) -> str:
        """The name of the function that searches, for tests."""
        return self.search.__name__


@dataclass(frozen=True)
class Verdict:
    """What a check found."""

    check: Check[Any]
    faults: tuple[Fault, ...] = ()
    left_out: str = ""
    """Why the check had nothing to look at; empty: it had."""


def promised(
    promise: str, read: str, first: bool = False
) -> Callable[[Callable[[Member], Iterator[Fault]]], Check[Member]]:
    """Make a check of a function that yields faults; the arguments are fields of `Check`."""

    def check(search: Callable[[Member], Iterator[Fault]]) -> Check[Member]:
        return Check(promise, read, search, first)

    return check


def ask(check: Check[Asked], member: Asked, home: type | None = None) -> Verdict:
    """Return the verdict of a check on a member; an error that the member raises is a fault.

    Args:
        check: what to ask.
        member: whom to ask.
        home: the member's class; errors are traced to its file.
    """
    faults: list[Fault] = []
    try:
        for fault in islice(check.search(member), MOST_FAULTS):
            faults.append(fault)
    except DoesWithoutError as reason:
        return Verdict(check, left_out=str(reason))
    except (Exception, SystemExit) as error:
        faults.append(Fault(f"it raised {described(error, home)}", "no error"))
    return Verdict(check, tuple(faults))


def examine(checks: Iterable[Check[Asked]], member: Asked, home: type | None = None) -> Iterator[Verdict]:
    """Yield the verdict of each check as soon as it is known; stop after a fault that leaves the others no meaning."""
    for check in checks:
        verdict = ask(check, member, home)
        yield verdict
        if check.first and verdict.faults:
            return


def described(error: BaseException, home: type | None) -> str:
    """Return an error in one line, with the last line of the member's own file on the way to it."""
    file = getattr(sys.modules.get(getattr(home, "__module__", "")), "__file__", None)
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if file and frame.filename == file]
    if not lines or isinstance(error, SyntaxError):
        return in_one_line(error)
    text = " ".join(traceback.format_exception_only(error)[-1].split())
    return f"{text} ({Path(str(file)).name}, line {lines[-1]})"


def undefined(member_class: type, base: type) -> list[str]:
    """Return the names that `base` declares without a value and that a subclass leaves without one."""
    declared = inspect.get_annotations(base)
    return [name for name in declared if not hasattr(base, name) and not hasattr(member_class, name)]


def counted(found: Iterable[object]) -> str:
    """Return a few things in words: the first three, and how many more there are."""
    texts = [str(thing) for thing in found]
    return ", ".join(texts[:3]) + (f" and {len(texts) - 3} more" if len(texts) > 3 else "")
