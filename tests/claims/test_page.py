"""Judged claims in words: counts, the page, and JSON values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from codesign_bench.claims.evidence import Evidence
from codesign_bench.claims.finding import CEILING, CONTRADICTED, SUPPORTED, UNDECIDED, Finding
from codesign_bench.claims.judging import judge, missing
from codesign_bench.claims.page import as_json, as_markdown, summary
from evidence import claim, study_of


def test_claims_of_each_verdict_are_counted_and_told() -> None:
    claims = [
        claim("one", Finding(SUPPORTED, 1.0, 0.5, 1.5, n="3 seeds", note="so be it")),
        claim("two", Finding(UNDECIDED, 2.0, 0.0, float("inf"), n="3 seeds")),
        claim("three", None),
    ]
    rows = judge(claims, Evidence(), "here")
    assert summary(rows) == (
        "3 claims: 1 supported, 0 contradicted, 2 undecided, 0 ceiling (1 undecided for lack of data)"
    )
    assert [row.interval for row in rows] == ["1.00 [0.50, 1.50]", "2.00 [0.00, never]", "-"]
    assert missing(rows) == ["make here"]
    study = study_of(claims)
    page = as_markdown(rows, study, Path("here"))
    assert "| sentence of one | *supported* | 1.00 [0.50, 1.50] |  |  | 3 seeds | kind | section | so be it |" in page
    assert "nothing there; needs: `make here`" in page
    assert "| kind | 1 | 0 | 2 | 0 |" in page
    assert "## Contradicted\n\nNone.\n" in page
    one, two, three = as_json(rows, study, Path("here"))["claims"]
    assert (one["value"], one["low"], one["high"]) == (1.0, 0.5, 1.5)
    assert (two["high"], three["value"], three["needs"]) == ("inf", None, ["make here"])


def test_checks_of_the_scenes_stand_apart() -> None:
    claims = [
        claim("found", Finding(CEILING, 0.1, 0.0, 0.2)),
        replace(claim("intended", Finding(SUPPORTED, 1.0, 0.5, 1.5)), check_of_scene=True),
    ]
    rows, study = judge(claims, Evidence(), "here"), study_of(claims)
    assert summary(rows) == (
        "1 claims: 0 supported, 0 contradicted, 0 undecided, 1 ceiling; "
        "1 checks of the scenes: 1 supported, 0 contradicted, 0 undecided, 0 ceiling (0 undecided for lack of data)"
    )
    content = as_json(rows, study, Path("here"))
    assert [entry["name"] for entry in content["claims"]] == ["found"]
    assert [entry["name"] for entry in content["checks_of_scenes"]] == ["intended"]
    page = as_markdown(rows, study, Path("here"))
    discoveries, checks = page.split("## Checks of the scenes")
    assert "| kind | 0 | 0 | 0 | 1 |" in discoveries
    assert "| kind (check of the scene) | 1 | 0 | 0 | 0 |" in discoveries
    assert "sentence of found" in discoveries.split("## Every claim")[1]
    assert "sentence of intended" not in discoveries.split("## Every claim")[1]
    assert "sentence of intended" in checks


def test_what_is_contradicted_is_listed_with_its_number() -> None:
    claims = [claim("one", Finding(CONTRADICTED, 0.25, 0.2, 0.3, n="3 seeds"))]
    page = as_markdown(judge(claims, Evidence(), "here"), study_of(claims), Path("here"))
    assert "- sentence of one: 0.25 [0.20, 0.30] (3 seeds)\n" in page
