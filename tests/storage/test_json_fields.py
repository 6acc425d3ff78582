"""Entries of a JSON object have the types that they must have, and errors name them."""

from __future__ import annotations

from typing import Any

import pytest

from codesign_bench.storage.json_fields import entries, number, optional, text, whole


def test_entries_are_returned_as_they_are() -> None:
    content: dict[str, Any] = {"name": "push", "seed": 3, "seconds": 1.5, "host": {"cpu": "x"}, "none": None}
    assert (text(content, "name"), whole(content, "seed"), number(content, "seconds")) == ("push", 3, 1.5)
    assert entries(content, "host") == {"cpu": "x"}
    assert number(content, "seed") == 3
    assert optional(text, content, "none") is None
    assert optional(text, content, "absent") is None


@pytest.mark.parametrize("value", [1.0, True, -1, 2**60, "1", None, [1], float("nan")])
def test_what_is_no_integer_from_0_is_named(value: Any) -> None:
    with pytest.raises(ValueError, match="'seed' is not an integer from 0"):
        whole({"seed": value}, "seed")


@pytest.mark.parametrize("value", [float("inf"), float("nan"), True, "1", None, {}])
def test_what_is_no_finite_number_is_named(value: Any) -> None:
    with pytest.raises(ValueError, match="'seconds' is not a finite number"):
        number({"seconds": value}, "seconds")


@pytest.mark.parametrize(
    ("value", "reason"), [(5, "is not text"), ("x" * 501, "has 501 characters"), ("\udcff", "has half a character")]
)
def test_what_is_no_text_is_named(value: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=f"'label' {reason}"):
        text({"label": value}, "label")
    assert text({"trace": "x" * 501}, "trace", most=None) == "x" * 501


def test_an_entry_that_is_absent_is_named() -> None:
    for read in (text, whole, number, entries):
        with pytest.raises(KeyError, match="seed"):
            read({}, "seed")
    with pytest.raises(ValueError, match="'host' is not an object"):
        entries({"host": []}, "host")
