"""Tables as text are read back as they were written."""

from __future__ import annotations

import pytest

from codesign_bench.text_tables import is_number, markdown, read_markdown


def test_a_markdown_table_is_read_as_it_was_written() -> None:
    header, rows = ["method", "p(a|b)"], [["one", "1|2"], ["", "3"]]
    assert read_markdown(markdown(header, rows)) == (header, rows)


def test_a_table_may_have_no_rows() -> None:
    assert read_markdown(markdown(["a"], [])) == (["a"], [])


@pytest.mark.parametrize(
    "text",
    ["", "some words", "| a |", "| a |\n| 1 |\n", "| a | b |\n| --- | --- |\n| 1 |\n", "# Title\n\n| a |\n| --- |\n"],
)
def test_other_texts_are_no_table(text: str) -> None:
    assert read_markdown(text) is None


@pytest.mark.parametrize(
    ("text", "expected"), [("1,234.5", True), ("-3", True), ("-", True), ("3 of 4", False), ("", False)]
)
def test_numbers_are_told_from_words(text: str, expected: bool) -> None:
    assert is_number(text) == expected
