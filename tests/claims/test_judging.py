"""Claims are judged one by one; then p-values are adjusted for all of a kind."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from codesign_bench import stats
from codesign_bench.claims.claim import Claim, Rule
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.finding import (
    CEILING,
    CONTRADICTED,
    LEVEL,
    NOT_ASKED,
    SUPPORTED,
    UNDECIDED,
    Finding,
    InsufficientData,
)
from codesign_bench.claims.judging import further_seeds, judge, missing
from codesign_bench.claims.page import as_json, as_markdown, summary
from codesign_bench.cli.program import build_parser
from codesign_bench.study.study import load_study, study_names
from evidence import claim, make_results, study_of

PAPER = load_study("corl2023")
CLAIMS = PAPER.claims()
ALL_CLAIMS = [claim for name in study_names() for claim in load_study(name).claims()]


def test_missing_data_are_named_with_the_command_that_makes_them_alike(tmp_path: Path) -> None:
    make_results(tmp_path)
    rows = {row.claim.name: row for row in judge(CLAIMS, load_evidence(tmp_path), str(tmp_path))}
    lacking = rows["final_return.push.cma_es"]
    assert lacking.finding.note == "0 finished seeds of push/cma_es/default; 3 are needed"
    (command,) = lacking.needs
    assert command == f"codesign-bench run --method all --task push --seeds 6 --profile quick --out {tmp_path}"
    assert rows["final_return.push.cma_rl"].needs == ()


def test_the_commands_for_missing_data_are_understood(tmp_path: Path) -> None:
    make_results(tmp_path)
    whatever_the_task = [replace(claim, tasks=()) for claim in ALL_CLAIMS]
    commands = missing(judge(whatever_the_task, load_evidence(tmp_path), str(tmp_path)))
    assert len(commands) == len(set(commands)) > 5
    for command in commands:
        assert build_parser().parse_args(command.split()[1:]).command


def test_p_values_are_adjusted_within_each_kind_of_rule() -> None:
    findings = {"a": 0.01, "b": 0.03, "c": 0.04, "d": math.nan}
    claims = [claim(name, Finding(SUPPORTED, 1.0, 0.5, 1.5, p=p)) for name, p in findings.items()]
    other = claim("other", Finding(CONTRADICTED, -1.0, p=0.04))
    claims.append(replace(other, rule=replace(other.rule, kind="another")))
    rows = judge([*claims, claim("lacking", None)], Evidence(), "here")
    # Of three: 0.01 times 3; 0.03 times 2; 0.04, but no less than that. A family of one stays as it is.
    adjusted = [row.finding.p_adjusted for row in rows]
    assert adjusted[:3] + adjusted[4:5] == pytest.approx([0.03, 0.06, 0.06, 0.04])
    assert [row.finding.family_size for row in rows] == [3, 3, 3, 0, 1, 0]
    verdicts = [row.finding.verdict for row in rows]
    assert verdicts == [SUPPORTED, UNDECIDED, UNDECIDED, SUPPORTED, CONTRADICTED, UNDECIDED]
    assert rows[1].finding.note == "p is 0.060 after adjustment for 3 claims"
    assert rows[0].p_values == ("0.010", "0.030 (3)")
    assert rows[3].p_values == ("", "")
    entry = as_json(rows, study_of(claims), Path("here"))["claims"][0]
    assert (entry["p"], entry["p_adjusted"], entry["family_size"]) == (0.01, pytest.approx(0.03), 3)
    assert "| 0.010 | 0.030 (3) |" in as_markdown(rows, study_of(claims), Path("here"))


def test_a_p_value_that_may_be_read_twice_counts_twice() -> None:
    once = claim("once", Finding(SUPPORTED, 1.0, 0.5, 1.5, p=0.015))
    twice = replace(claim("twice", Finding(SUPPORTED, 1.0, 0.5, 1.5, p=0.012)), looks=2)
    hopeless = replace(claim("hopeless", Finding(UNDECIDED, 0.1, -0.5, 0.7, p=0.7)), looks=2)
    rows = judge([once, twice, hopeless], Evidence(), "here")
    # 0.015 is now the least of three (times 3); 0.024 the second (times 2); 1.4 is 1.
    assert [row.finding.p_adjusted for row in rows] == pytest.approx([0.045, 0.048, 1.0])
    assert [entry["looks"] for entry in as_json(rows, study_of([]), Path("here"))["claims"]] == [1, 2, 2]


def test_two_looks_at_nothing_err_as_rarely_as_promised() -> None:
    """Five seeds of each method and, where they do not differ, five more: both methods are the same."""
    rng, level, wrong = np.random.default_rng(0), 0.05, {1: 0, 2: 0}
    for _ in range(2000):
        first, second = rng.normal(size=(2, 10))
        smallest = min(stats.welch(first[:count], second[:count]).p for count in (5, 10))
        for looks in wrong:
            wrong[looks] += looks * smallest < level
    assert wrong[1] / 2000 > 0.065, "reading twice as if once errs too often"
    assert wrong[2] / 2000 < 0.05


@pytest.mark.parametrize("spread", [1.0, 0.3])
@pytest.mark.parametrize("difference", [0.0, 1.0, 2.0, 4.0])
def test_intervals_at_the_end_of_two_stages_contain_what_they_promise(difference: float, spread: float) -> None:
    """Five seeds of each method, five more unless the first look decides one claim or the first of nine."""
    rng, looks = np.random.default_rng(0), 2
    first, second = rng.normal(difference, 1.0, (2000, 10)), rng.normal(0.0, spread, (2000, 10))
    for family in (1, 9):
        contained = 0
        for one, other in zip(first, second, strict=True):
            found = stats.welch(one[:5], other[:5])
            if looks * family * found.p >= LEVEL:
                found = stats.welch(one, other)
            contained += found.low <= difference <= found.high
        assert 0.92 < contained / 2000 < 0.97


def test_missing_seeds_are_counted_from_the_first_that_is_there() -> None:
    def lacking(evidence: Evidence, rng: np.random.Generator) -> Finding:
        raise InsufficientData("nothing there")

    needs = ("run --seeds {seeds[6]}{profile} --out {results}", "deploy --policy {results}/seed-{seed[1]:02d}")
    asked = Claim("lacking", "", "", Rule("", "", "", needs, lacking))
    frame = pd.DataFrame({"task": "push", "method": "gnn_ppo", "variant": "default", "seed": [102, 100, 101]})
    cells = {"nothing": Evidence(), "reported": Evidence(evaluations=frame, profile="workstation")}
    rows = {name: judge([asked], evidence, "here")[0] for name, evidence in cells.items()}
    assert rows["nothing"].needs == ("run --seeds 6 --out here", "deploy --policy here/seed-01")
    assert rows["reported"].needs == (
        "run --seeds 100-105 --profile workstation --out here",
        "deploy --policy here/seed-101",
    )


def test_what_the_scenes_were_chosen_for_is_a_check_of_them() -> None:
    checks = {entry.name for entry in CLAIMS if entry.check_of_scene}
    assert {name for name in checks if name.endswith("shared_arch")} == set()
    assert {entry.name for entry in CLAIMS if entry.name.startswith("no_single_tool.")} <= checks
    for baseline in ("cma_rl", "hwasp_minimal", "cma_es"):
        assert {entry.name for entry in CLAIMS if entry.name.endswith(f".{baseline}")} <= checks


def test_a_claim_about_a_task_without_results_is_not_asked() -> None:
    asked = claim("asked", Finding(SUPPORTED, 1.0))
    elsewhere = replace(claim("elsewhere", Finding(SUPPORTED, 1.0)), tasks=("weave",))
    rows = judge([asked, elsewhere], Evidence(), "here")
    assert [row.finding.verdict for row in rows] == [SUPPORTED, NOT_ASKED]
    assert summary(rows) == (
        "1 claims: 1 supported, 0 contradicted, 0 undecided, 0 ceiling (0 undecided for lack of data); "
        "1 more not asked, without results of all of weave"
    )
    assert missing(rows) == []
    assert "sentence of elsewhere" not in as_markdown(rows, study_of([asked, elsewhere]), Path("here"))


def test_a_new_claim_moves_no_other_draw() -> None:
    def drawn(evidence: Evidence, rng: np.random.Generator) -> Finding:
        return Finding(UNDECIDED, float(rng.random()))

    first, second = (Claim(name, "", "", Rule("", "", "", (), drawn)) for name in ("first", "second"))
    values = [row.finding.value for row in judge([first, second], Evidence(), "")]
    assert values[0] != values[1]
    assert [row.finding.value for row in judge([second], Evidence(), "")] == values[1:]


def test_names_of_claims_are_unique_and_commands_have_their_places() -> None:
    names = [claim.name for claim in ALL_CLAIMS]
    assert len(names) == len(set(names))
    for entry in ALL_CLAIMS:
        assert entry.rule.needs
        assert all("{results}" in command for command in entry.rule.needs)


@pytest.mark.parametrize(
    ("verdict", "equivalent", "seeds", "asked"),
    [
        (UNDECIDED, False, (5, 5), "105-109"),
        (UNDECIDED, False, (10, 5), "105-109"),
        (UNDECIDED, False, (3, 5), "103-109"),
        (UNDECIDED, False, (10, 10), None),
        (UNDECIDED, True, (5, 5), None),
        (SUPPORTED, False, (5, 5), None),
        (CEILING, False, (5, 5), None),
    ],
)
def test_what_the_first_look_leaves_open_asks_for_further_seeds(
    verdict: str, equivalent: bool, seeds: tuple[int, int], asked: str | None
) -> None:
    methods = ("gnn_ppo", "cma_rl")
    cells = [(method, 100 + seed) for method, count in zip(methods, seeds, strict=True) for seed in range(count)]
    frame = pd.DataFrame(cells, columns=["method", "seed"]).assign(task="push", variant="default")
    finding = Finding(verdict, 0.1, -0.5, 0.7, p=0.001, equivalent=equivalent)
    comparison = replace(claim("open", finding), tasks=("push",), adds_seeds_of=methods)
    rows = judge([comparison, replace(comparison, name="same")], Evidence(evaluations=frame), "here")
    command = f"codesign-bench run --method gnn_ppo cma_rl --task push --seeds {asked} --out here"
    assert further_seeds(rows) == ([] if asked is None else [command])
    if asked is not None:
        assert build_parser().parse_args(command.split()[1:]).command
        assert command in as_markdown(rows, study_of([comparison]), Path("here"))


def test_a_verdict_is_not_final_while_seeds_of_the_last_look_are_missing() -> None:
    cells = [
        (task, method, seed)
        for task, count in (("push", 5), ("scoop", 10))
        for method in ("gnn_ppo", "cma_rl")
        for seed in range(100, 100 + count)
    ]
    frame = pd.DataFrame(cells, columns=["task", "method", "seed"]).assign(variant="default")
    asks = replace(
        claim("asks", Finding(UNDECIDED, 0.1, -0.5, 0.7, p=0.5)), tasks=("push",), adds_seeds_of=("gnn_ppo", "cma_rl")
    )
    over_both = claim("over both", Finding(SUPPORTED, 1.0, 0.5, 1.5, p=0.001, note="clear"))
    over_both = replace(over_both, tasks=("push", "scoop"), looks=2)
    read_once = replace(over_both, name="read once", looks=1)
    elsewhere = replace(over_both, name="elsewhere", tasks=("scoop",))
    rows = judge([asks, over_both, read_once, elsewhere], Evidence(evaluations=frame), "here")
    assert [row.awaits for row in rows[1:]] == [("push",), (), ()]
    assert rows[1].note == "clear; not final: seeds are missing on push"
    assert rows[1].note in as_markdown(rows, study_of([]), Path("here"))
    assert [row.note for row in rows[2:]] == ["clear", "clear"]
    assert [entry["awaits"] for entry in as_json(rows, study_of([]), Path("here"))["claims"][1:]] == [["push"], [], []]


def test_seeds_that_tuning_may_have_used_are_never_added() -> None:
    cells = [(method, seed) for method in ("gnn_ppo", "cma_rl") for seed in range(6)]
    frame = pd.DataFrame(cells, columns=["method", "seed"]).assign(task="push", variant="default")
    undecided = claim("open", Finding(UNDECIDED, 0.1, -0.5, 0.7, p=0.5))
    comparison = replace(undecided, tasks=("push",), adds_seeds_of=("gnn_ppo", "cma_rl"))
    (command,) = further_seeds(judge([comparison], Evidence(evaluations=frame), "here"))
    assert "--seeds 10-13 " in command


def test_what_lacks_data_asks_for_those_first() -> None:
    lacking = replace(claim("lacking", None), adds_seeds_of=("gnn_ppo", "cma_rl"))
    (row,) = judge([lacking], Evidence(), "here")
    assert row.needs == ("make here",)
    assert row.further_seeds == ""
