"""Text of another person's results controls neither the terminal nor a figure."""

from __future__ import annotations

import pytest

from codesign_bench.visible_text import MOST_IN_FIGURE, in_figure, on_one_line, visible


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[2Jgone", r"\x1b[2Jgone"),
        ("\x07\x00\x7f\x9b", r"\x07\x00\x7f\x9b"),
        ("a\rb", r"a\rb"),
        ("\u202egnp.exe", r"\u202egnp.exe"),
        ("a path \udcff", r"a path \udcff"),
        ("\u2028", r"\u2028"),
    ],
)
def test_what_would_control_a_terminal_is_shown_as_an_escape(text: str, shown: str) -> None:
    assert visible(text) == shown


@pytest.mark.parametrize("text", ["", "GNN-PPO, joint credit", "two\nlines\tand a tab", "方法 метод ± 🙂", r"\x1b"])
def test_other_text_stays_as_it_is(text: str) -> None:
    assert visible(text) == text


def test_a_cell_of_a_table_is_on_one_line() -> None:
    assert on_one_line("one\ntwo\tthree\r\n") == r"one two three\r "


def test_a_figure_shows_dollars_and_never_a_formula() -> None:
    assert in_figure(r"$\frac{1$ costs $5") == r"\$\frac{1\$ costs \$5"
    assert len(in_figure("x" * 10_000)) == MOST_IN_FIGURE
    assert in_figure("x" * MOST_IN_FIGURE) == "x" * MOST_IN_FIGURE
