"""Tables as text are read back as they were written."""

from __future__ import annotations

import pytest

from codesign_bench.text_tables import is_number, latex, markdown, plain_markdown, read_markdown


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
    ("text", "shown"),
    [
        ("<script>alert(1)</script>", "&lt;script>alert(1)&lt;/script>"),
        ("<!-- hidden", "&lt;!-- hidden"),
        ("&lt;b&gt;", "&amp;lt;b&amp;gt;"),
        ("![x](http://example.com/x)", "![x]\\(http://example.com/x)"),
        ("two\nlines | \x1b[2J", r"two lines \| \x1b[2J"),
        ("p < 0.05 & n > 3", "p < 0.05 & n > 3"),
    ],
)
def test_a_cell_of_a_markdown_table_is_never_markup(text: str, shown: str) -> None:
    assert markdown([text], []) == f"| {shown} |\n| --- |\n"


def test_what_stands_for_markup_is_read_as_what_it_was() -> None:
    rows = [["<b>a</b> & b", "&lt;c&gt;", "[d](e) | f"]]
    assert read_markdown(markdown(["x", "y", "z"], rows)) == (["x", "y", "z"], rows)
    assert plain_markdown("words") == "words"


def test_a_latex_table_has_no_commands_but_its_own() -> None:
    table = latex([r"\input{x}"], [["100% & $5_{~^#"], ["two\nlines"]])
    assert r"\textbackslash{}input\{x\} \\" in table
    assert r"100\% \& \$5\_\{\textasciitilde{}\textasciicircum{}\# \\" in table
    assert r"two lines \\" in table


@pytest.mark.parametrize(
    ("text", "expected"), [("1,234.5", True), ("-3", True), ("-", True), ("3 of 4", False), ("", False)]
)
def test_numbers_are_told_from_words(text: str, expected: bool) -> None:
    assert is_number(text) == expected
