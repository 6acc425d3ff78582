"""Text of the command line becomes values of the types that settings declare."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

import pytest

from codesign_bench.config.values import LONGEST_SHOWN, Length, Share, Within, parse_int, parse_value, shown


@pytest.mark.parametrize(
    ("annotation", "text", "value"),
    [
        (int, "1_000", 1000),
        (int, "1e6", 1_000_000),
        (float, "3e-4", 3e-4),
        (bool, "False", False),
        (str, "relu", "relu"),
        (tuple[int, ...], "256,256", (256, 256)),
        (tuple[int, ...], "(64)", (64,)),
        (float | None, "none", None),
        (float | None, "0.5", 0.5),
        (Literal["joint", "separate"], "joint", "joint"),
        (Share, "1", 1.0),
        (Annotated[tuple[Share, ...], Length(1, 2)], "0.5,1", (0.5, 1.0)),
    ],
)
def test_text_becomes_a_value_of_the_fields_type(annotation: Any, text: str, value: Any) -> None:
    parsed = parse_value(annotation, text)
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize(
    "text", ["5.5", "many", "", "inf", "nan", "1e400", "9" * 5_000, "\u0663", "\uff11", "0x10", "1__0", "_1"]
)
def test_what_is_not_an_integer_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="an integer"):
        parse_int(text)


@pytest.mark.parametrize(
    ("kind", "text", "expected"),
    [
        (float, "nan", "a number"),
        (float, "-inf", "a number"),
        (float, "1e400", "a number"),
        (float, "\u0661", "a number"),
        (float, "1 2", "a number"),
        (Share, "1.01", "a number from 0 to 1"),
        (Annotated[float, Within(0, 1, open_low=True, open_high=True)], "0", "a number above 0 to below 1"),
        (Annotated[int, Within(1, 4_096)], "0", "an integer from 1 to 4,096"),
        (Annotated[int, Within(1, 4_096)] | None, "5000", "an integer from 1 to 4,096 or none"),
        (bool, "maybe", "true or false"),
        (tuple[int, ...], "1,x", "values separated by commas, each an integer"),
        (tuple[int, int], "1", "2 values separated by commas"),
        (Annotated[tuple[int, ...], Length(1, 2)], "", "values separated by commas, 1 to 2 of them, each an integer"),
        (dict, "{}", "a value of type <class 'dict'>"),
    ],
)
def test_what_is_not_of_its_kind_is_refused_with_what_was_expected(kind: Any, text: str, expected: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(expected)}$"):
        parse_value(kind, text)


def test_a_message_repeats_a_users_text_printable_and_not_too_long() -> None:
    assert shown("few") == "'few'"
    assert shown("a\nb\x1b[2J") == "'a?b?[2J'"
    assert len(shown("9" * 5_000)) < LONGEST_SHOWN + 10
