"""Cells that other code has run: told where it is the package's, refused where it is the task's or the method's own."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from builders import VERSION_0_1_0, sweep, toy_cells
from codesign_bench.cell.cell import resolve_cells
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.storage.records import FAILED, RUNNING
from codesign_bench.sweep.plan import make_plan

pytestmark = pytest.mark.usefixtures("toy")

OTHER = "0" * 64


def edit(out: Path, change: Callable[[dict[str, Any]], object], pattern: str = "*/*/*/*/cell.json") -> list[Path]:
    """Change what cells record; return their files."""
    paths = sorted(out.glob(pattern))
    for path in paths:
        content = json.loads(path.read_text())
        change(content)
        path.write_text(json.dumps(content))
    return paths


def of_other_code(kind: str) -> Callable[[dict[str, Any]], object]:
    """Return a change after which a cell was run with other own code of its task or method."""
    return lambda content: content["members"][kind]["files"].update(toy=OTHER)


def test_a_cell_records_the_code_of_task_method_and_their_packages(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path)
    (path,) = tmp_path.glob("*/*/*/*/cell.json")
    content = json.loads(path.read_text())
    for kind in ("task", "method"):
        assert content["members"][kind]["module"] == "toy"
        assert set(content["members"][kind]["files"]) == {"toy"}
    assert set(content["packages"]) == {"toy"}
    assert len(content["packages"]["toy"]["fingerprint"]) == 64


@pytest.mark.parametrize("kind", ["task", "method"])
def test_a_done_cell_of_other_own_code_is_refused_with_the_ways_out(tmp_path: Path, kind: str) -> None:
    sweep(toy_cells(2), tmp_path)
    edit(tmp_path, of_other_code(kind))
    name = {"task": "toy_reach", "method": "toy_search"}[kind]
    with pytest.raises(UserError) as refused:
        sweep(toy_cells(2), tmp_path)
    first, second = str(refused.value).splitlines()
    assert first.endswith(f"seed-00 (and 1 more cells) was run with other code of {kind} '{name}' (toy)")
    for way in ("choose another --out", "go back to that code (toy: ", "--same-code"):
        assert way in second


@pytest.mark.parametrize("kind", ["task", "method"])
def test_it_counts_if_the_user_says_that_it_makes_no_difference(tmp_path: Path, kind: str) -> None:
    sweep(toy_cells(), tmp_path)
    before = [path.read_text() for path in edit(tmp_path, of_other_code(kind))]
    code, text = sweep(toy_cells(), tmp_path, same_code=True)
    assert code == 0
    assert "1 stored cell with other code of task or method: counted all the same (--same-code)" in text
    assert [path.read_text() for path in tmp_path.glob("*/*/*/*/cell.json")] == before


def interrupt(content: dict[str, Any]) -> None:
    """Make a cell one that was interrupted under other own code."""
    content["status"] = RUNNING
    of_other_code("method")(content)


def test_an_interrupted_cell_of_other_own_code_is_not_resumed(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path)
    edit(tmp_path, interrupt)
    with pytest.raises(UserError, match="was run with other code of method 'toy_search'"):
        sweep(toy_cells(), tmp_path)
    code, _ = sweep(toy_cells(), tmp_path, same_code=True)
    (path,) = tmp_path.glob("*/*/*/*/cell.json")
    content = json.loads(path.read_text())
    assert (code, content["status"]) == (0, "done")
    assert content["earlier"][0]["members"]["method"]["files"] == {"toy": OTHER}
    assert content["members"]["method"]["files"]["toy"] != OTHER


def test_a_cell_that_failed_with_other_own_code_starts_anew_and_blocks_nothing(tmp_path: Path) -> None:
    cells = toy_cells(overrides=("evaluations=4", "fail_at=100"))
    code, text = sweep(cells, tmp_path)
    assert code == 1, text
    (path,) = edit(tmp_path, of_other_code("method"))
    checkpoint = path.parent / "checkpoint.safetensors"
    assert checkpoint.exists()
    code, text = sweep(cells, tmp_path)
    assert code == 1
    assert "failed earlier" in text
    code, text = sweep(cells, tmp_path, retry_failed=True)
    assert "1 stored cell that failed with other code of task or method: started anew" in text
    content = json.loads(path.read_text())
    assert (content["status"], content["earlier"]) == (FAILED, [])


def test_a_cell_is_not_started_from_one_of_other_own_code(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path)
    edit(tmp_path, of_other_code("method"))
    tuned = resolve_cells(toy_cells(variants=[Variant.of(finetune=1)]))
    with pytest.raises(UserError, match=r"default.seed-00 was run with other code of method 'toy_search'"):
        make_plan(tuned, tmp_path)
    assert len(make_plan(tuned, tmp_path, same_code=True).pending) == 1


@pytest.mark.parametrize(("entry", "name"), [("packages", "toy"), ("code", "codesign_bench")])
def test_other_code_of_a_package_is_told_and_counts(tmp_path: Path, entry: str, name: str) -> None:
    def change(content: dict[str, Any]) -> None:
        state = content["packages"]["toy"] if entry == "packages" else content["code"]
        state.update(fingerprint=OTHER, commit=None)

    sweep(toy_cells(), tmp_path)
    edit(tmp_path, change)
    code, text = sweep(toy_cells(), tmp_path)
    assert code == 0
    assert f"1 stored cell with other code of {name}: files 000000000000; now " in text


def test_the_same_code_needs_no_word(tmp_path: Path) -> None:
    sweep(toy_cells(), tmp_path)
    assert make_plan(resolve_cells(toy_cells()), tmp_path).notes == []


def test_cells_of_earlier_versions_count_as_done_and_one_line_says_so(tmp_path: Path) -> None:
    def forget(content: dict[str, Any]) -> None:
        del content["members"], content["packages"], content["code"]

    sweep(toy_cells(2), tmp_path)
    edit(tmp_path, forget)
    plan = make_plan(resolve_cells(toy_cells(2)), tmp_path)
    assert len(plan.done) == 2
    (line,) = plan.notes
    assert line.startswith("2 stored cells of an earlier version without a record of their task's and method's code")


def test_there_are_such_cells() -> None:
    (path, *_) = VERSION_0_1_0.glob("*/*/*/*/cell.json")
    assert json.loads(path.read_text()).keys().isdisjoint({"members", "packages", "code"})
