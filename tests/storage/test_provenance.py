"""How cells were made otherwise: a line per kind of difference that can change numbers; none where all is alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from builders import store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.member_code import MemberCode
from codesign_bench.storage.cells import find_cells
from codesign_bench.storage.provenance import (
    HEADING,
    as_markdown,
    code,
    differences,
    processor,
    records_of,
    same_conditions,
)
from codesign_bench.storage.records import FAILED, CellRecord

CODE = {"version": "0.2.0", "commit": "a" * 40, "changed": False, "fingerprint": "1" * 64}
OTHER = {**CODE, "commit": "b" * 40, "fingerprint": "2" * 64}
HOST = {"name": "desk", "cpu": "some CPU", "instruction_sets": ["avx2"], "library_settings": {}}
VERSIONS = {"python": "3.11.7", "numpy": "2.4.6", "codesign_bench": "0.2.0"}


def record(task: str = "push", **changes: Any) -> CellRecord:
    """Return the record of a cell."""
    fields = {"versions": VERSIONS, "code": CODE, "host": HOST, "method": "gnn_ppo", "variant": Variant(()), "seed": 0}
    return CellRecord(task=task, **{**fields, **changes})


def lines(*records: CellRecord) -> list[str]:
    """Return the lines on one folder below the heading."""
    found = differences({"runs": records})
    assert found[:1] == ([HEADING] if found else [])
    return found[1:]


def test_cells_that_were_made_alike_need_no_word() -> None:
    elsewhere = {**HOST, "name": "another of this kind", "cores": 64, "threads": 2}
    assert lines() == []
    assert lines(record(), record(seed=1), record(host=elsewhere)) == []


def test_commits_that_hold_the_same_code_are_no_difference() -> None:
    assert lines(record(), record(code={**OTHER, "fingerprint": CODE["fingerprint"]})) == []


def test_each_kind_of_difference_is_a_line_with_the_cells_of_each_value() -> None:
    changed = {**OTHER, "changed": True}
    newer = {**HOST, "instruction_sets": ["avx2", "avx512f"], "library_settings": {"MKL_CBWR": "AVX2"}}
    versions = {**VERSIONS, "numpy": "1.26.4", "codesign_bench": "0.1.0"}
    assert lines(
        record("scoop", code=changed, host=newer, versions=versions, earlier=({"code": CODE},)),
        record(seed=1),
        record(seed=2),
    ) == [
        "commits: aaaaaaaaaaaa (2 cells of push), bbbbbbbbbbbb with changes (files 222222222222) (1 cell of scoop)",
        "changes that are in no commit: 1 cell of scoop",
        "processors: some CPU (avx2) (2 cells of push), some CPU (avx2, avx512f; MKL_CBWR=AVX2) (1 cell of scoop)",
        "libraries: numpy 2.4.6 (2 cells of push), 1.26.4 (1 cell of scoop)",
        "resumed under other code, processors or libraries than begun: 1 cell of scoop",
    ]


def test_packages_of_other_members_are_compared_where_they_are_recorded() -> None:
    first, second = ({"sticks": code_of} for code_of in (CODE, OTHER))
    assert lines(record(), record(packages=first), record(packages=first, seed=1)) == []
    assert lines(record(), record(packages=first), record("scoop", packages=second)) == [
        "commits of sticks: aaaaaaaaaaaa (1 cell of push), bbbbbbbbbbbb (1 cell of scoop)"
    ]


def test_cells_are_told_by_what_separates_them_or_else_counted() -> None:
    assert lines(record(), record(seed=1, code=OTHER)) == ["commits: aaaaaaaaaaaa (1 cell), bbbbbbbbbbbb (1 cell)"]
    varied = record(code=OTHER, variant=Variant.of(alpha=0.3))
    assert lines(record(), varied) == ["commits: aaaaaaaaaaaa (1 cell of default), bbbbbbbbbbbb (1 cell of alpha-0.30)"]


def test_folders_are_told_apart_by_their_names() -> None:
    found = differences({"runs": [record(), record(seed=1)], "reference": [record(code=OTHER)]})
    assert found[1:] == ["commits: aaaaaaaaaaaa (2 cells of runs), bbbbbbbbbbbb (1 cell of reference)"]


def test_what_old_cells_lack_is_called_not_recorded_and_a_package_they_lack_is_no_difference() -> None:
    old = record("scoop", code={}, host={"cpu": "some CPU"}, versions={"numpy": "2.4.6"})
    assert lines(old, replace(old, seed=1)) == ["commits: not recorded (all 2 cells)"]
    assert lines(old, record()) == [
        "commits: not recorded (1 cell of scoop), aaaaaaaaaaaa (1 cell of push)",
        "processors: some CPU (instruction sets not recorded) (1 cell of scoop), some CPU (avx2) (1 cell of push)",
    ]


def test_code_without_a_commit_is_told_by_its_fingerprint() -> None:
    assert code(record(code={**CODE, "commit": None}).conditions) == "files 111111111111"
    assert processor(record(host={}).conditions) == "not recorded"


@pytest.mark.parametrize(
    ("changes", "same"),
    [
        ({"code": {**CODE, "commit": "c" * 40}}, True),
        ({"host": {**HOST, "name": "another of this kind"}}, True),
        ({"code": OTHER}, False),
        ({"host": {**HOST, "instruction_sets": []}}, False),
        ({"versions": {**VERSIONS, "numpy": "1.26.4"}}, False),
        ({"packages": {"sticks": OTHER}}, False),
        ({"packages": {"balls": OTHER}}, True),
        ({"packages": {"sticks": {**CODE, "commit": "c" * 40}}}, True),
        ({"packages": {}, "members": {}}, True),
        ({"members": {"task": MemberCode("sticks.reach", "sticks", {"sticks.reach": "2"})}}, False),
    ],
)
def test_conditions_are_the_same_if_nothing_differs_that_can_change_numbers(
    changes: dict[str, Any], same: bool
) -> None:
    own = MemberCode("sticks.reach", "sticks", {"sticks.reach": "1"})
    begun = record(packages={"sticks": CODE}, members={"task": own})
    resumed = replace(begun, **changes)
    assert same_conditions(begun.conditions, resumed.conditions) == same


def test_only_finished_cells_count(tmp_path: Path) -> None:
    store_cell(tmp_path, seed=0)
    store_cell(tmp_path, seed=1, status=FAILED)
    assert [one.seed for one in records_of(find_cells(tmp_path))] == [0]


def test_as_markdown_the_kinds_are_a_list() -> None:
    assert as_markdown(["Heading:", "one", "two"]) == "Heading:\n\n- one\n- two\n"
