"""Text of the command line becomes values of the types that settings declare."""

from __future__ import annotations

from typing import Any, Literal

import pytest

from codesign_bench.config.values import parse_int, parse_value


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
    ],
)
def test_text_becomes_a_value_of_the_fields_type(annotation: Any, text: str, value: Any) -> None:
    parsed = parse_value(annotation, text)
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize("text", ["5.5", "many", "", "inf", "nan"])
def test_what_is_not_an_integer_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="an integer"):
        parse_int(text)
