"""An unknown name is answered with those that there are."""

from __future__ import annotations

from codesign_bench.errors import UserError, unknown_name


def test_an_unknown_name_is_told_with_its_kind_and_the_choices_in_their_order() -> None:
    error = unknown_name("task", "pull", ["push", "catch_balls"])
    assert isinstance(error, UserError)
    assert str(error) == "unknown task 'pull'; choose from: push, catch_balls"


def test_a_name_from_somebody_elses_file_controls_no_terminal() -> None:
    assert str(unknown_name("task", "\x1b[31mred\n", ["push"])) == r"unknown task '\x1b[31mred '; choose from: push"
