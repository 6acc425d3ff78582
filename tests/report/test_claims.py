"""Claims as a page shows them."""

from __future__ import annotations

import math

from codesign_bench.claims.claim import Claim, Rule
from codesign_bench.claims.finding import Finding
from codesign_bench.claims.judging import Row
from codesign_bench.report.claims import part


def test_claims_with_data_are_told_apart_from_those_that_lack_some() -> None:
    rule = Rule("higher", "difference of means", "supported above 0", ("codesign-bench run",), judge=lambda *_: told)
    told = Finding("supported", 0.5, 0.25, 0.75, n="6 and 6 seeds", note="clear", p=0.01).adjusted(0.03, 3)
    lacking = Finding("undecided", math.nan, note="no seeds")
    shown = part(
        [
            Row(Claim("one", "A beats B.", "figure 1", rule), told),
            Row(Claim("scene", "A beats E.", "figure 1", rule, check_of_scene=True), told),
            Row(Claim("two", "C beats D.", "figure 1", rule), lacking, ("codesign-bench run",)),
        ]
    )
    assert shown.table is not None
    assert list(shown.table.rows) == [
        ("supported", "A beats B.", "0.50 [0.25, 0.75]", "0.010", "0.030 (3)", "6 and 6 seeds", "higher", "clear"),
    ]
    assert shown.checks is not None
    assert [row[1] for row in shown.checks.rows] == ["A beats E."]
    assert shown.rules is not None
    assert list(shown.rules.rows) == [("higher", "difference of means", "supported above 0")]
    assert shown.lacking is not None
    assert list(shown.lacking.rows) == [("C beats D.", "no seeds")]
    assert shown.commands == ["codesign-bench run"]
