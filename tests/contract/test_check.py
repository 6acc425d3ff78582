"""A check: verdicts, errors that become faults, and what is shown of them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from codesign_bench.contract import DoesWithoutError, Fault, ask, examine, promised
from codesign_bench.contract.check import MOST_FAULTS, counted, described, undefined


@promised("A number is even.", "int")
def even(number: int) -> Iterator[Fault]:
    """Yield why it is not."""
    if number < 0:
        raise DoesWithoutError("it is negative")
    if number % 2:
        yield Fault(f"{number}", "an even number")
    if number > 100:
        yield from (Fault("too many", "fewer") for _ in iter(int, 1))
    if number == 7:
        raise ZeroDivisionError("seven")


@promised("A number is small.", "int", first=True)
def small(number: int) -> Iterator[Fault]:
    """Yield that it is not."""
    if number > 5:
        yield Fault("large", "small")


def test_a_verdict_has_the_faults_or_why_nothing_was_asked() -> None:
    assert ask(even, 2).faults == ()
    assert ask(even, 3).faults == (Fault("3", "an even number"),)
    assert ask(even, -1).left_out == "it is negative"
    assert even.name == "even"


def test_an_error_is_a_fault_beside_those_found_before() -> None:
    first, second = ask(even, 7).faults
    assert first == Fault("7", "an even number")
    assert second.found.startswith("it raised ZeroDivisionError: seven (test_check.py, line ")


def test_only_the_first_faults_are_shown() -> None:
    assert len(ask(even, 200).faults) == MOST_FAULTS


def test_nothing_is_asked_after_a_check_that_must_hold_first() -> None:
    assert [verdict.check for verdict in examine([even, small, even], 3)] == [even, small, even]
    assert [verdict.check for verdict in examine([even, small, even], 9)] == [even, small]


class Member:
    """A member whose file is this one."""

    def fail(self) -> None:
        """Fail in somebody else's code."""
        int("one")


def test_an_error_is_traced_to_the_members_file() -> None:
    with pytest.raises(ValueError, match="one") as raised:
        Member().fail()
    assert "(test_check.py, line " in described(raised.value, Member)


class Base:
    """Declares two names, one of them with a value."""

    first: int
    second: int = 2


def test_names_without_a_value_are_undefined() -> None:
    assert undefined(type("Empty", (Base,), {}), Base) == ["first"]
    assert undefined(type("Full", (Base,), {"first": 1}), Base) == []


def test_a_few_things_are_told_in_words() -> None:
    assert counted([]) == ""
    assert counted([1, 2, 3]) == "1, 2, 3"
    assert counted("abcde") == "a, b, c and 2 more"
