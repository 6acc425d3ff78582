"""Verdicts of two results side by side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from codesign_bench.claims.agreement import (
    HERE_ONLY,
    OPPOSITE,
    OTHERWISE,
    SAME,
    THERE_ONLY,
    as_json,
    as_markdown,
    pairs,
    summary,
)
from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CEILING, CONTRADICTED, SUPPORTED, UNDECIDED, Finding
from codesign_bench.claims.judging import Row, judge
from evidence import claim, study_of


def rows(verdicts: dict[str, str]) -> list[Row]:
    """Return claims with these verdicts, each of value 1."""
    return judge([claim(name, Finding(verdict, 1.0)) for name, verdict in verdicts.items()], Evidence(), "here")


HERE = {"a": SUPPORTED, "b": SUPPORTED, "c": UNDECIDED, "d": CONTRADICTED, "e": CEILING, "only": SUPPORTED}
THERE = {"e": UNDECIDED, "d": SUPPORTED, "c": CONTRADICTED, "b": UNDECIDED, "a": SUPPORTED}


def test_opposite_verdicts_come_first_and_equal_ones_last() -> None:
    found = pairs(rows(HERE), rows(THERE))
    assert [(pair.claim.name, pair.agreement) for pair in found] == [
        ("d", OPPOSITE),
        ("b", HERE_ONLY),
        ("c", THERE_ONLY),
        ("e", OTHERWISE),
        ("a", SAME),
    ]
    assert summary(found) == (
        "5 claims with data in both: 1 opposite, 1 decided here, 1 decided there, 1 other verdict, 1 same"
    )


def test_what_one_side_has_no_data_for_is_not_compared() -> None:
    lacking = judge([claim("a", None)], Evidence(), "here")
    elsewhere = judge([replace(claim("a", Finding(SUPPORTED, 1.0)), tasks=("weave",))], Evidence(), "here")
    for other in (lacking, elsewhere, []):
        assert pairs(rows({"a": SUPPORTED}), other) == pairs(other, rows({"a": SUPPORTED})) == []


def test_the_page_and_its_values_name_both_results_and_how_they_were_made() -> None:
    found = pairs(rows({"a": SUPPORTED}), rows({"a": CONTRADICTED}))
    given = study_of([]), Path("one"), Path("two"), ["heading", "processors: 2"]
    page, values = as_markdown(found, *given), as_json(found, *given)
    assert "Here is `one`, there is `two`. 1 claims with data in both: 1 opposite" in page
    assert "| a | opposite | supported | contradicted | 1.00 | 1.00 |" in page
    assert "- processors: 2" in page
    assert (values["here"], values["there"], values["made"]) == ("one", "two", ["heading", "processors: 2"])
    (entry,) = values["claims"]
    assert (entry["here"]["verdict"], entry["there"]["verdict"]) == (SUPPORTED, CONTRADICTED)
