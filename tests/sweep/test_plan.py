"""Before anything runs, every cell of a sweep is done, failed, unusable or to be run; what differs is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import sweep
from builders import toy_cells as cells
from codesign_bench.cell.cell import Cell, resolve_cells
from codesign_bench.errors import UserError
from codesign_bench.sweep.plan import make_plan
from toy import ToyReach

pytestmark = pytest.mark.usefixtures("toy")

CELL = Cell("toy_reach", "toy_search", seed=0, steps=200, overrides=("evaluations=4",))


def test_cells_are_sorted_by_what_is_stored(tmp_path: Path) -> None:
    sweep(cells(1), tmp_path)
    broken = Cell("toy_reach", "toy_search", seed=1, steps=200, overrides=("evaluations=4", "fail_at=150"))
    sweep([broken], tmp_path)
    new = Cell("toy_reach", "toy_search", seed=2, steps=200, overrides=("evaluations=4",))
    chosen = resolve_cells([CELL, broken, new])
    plan = make_plan(chosen, tmp_path)
    assert (plan.done, list(plan.failed), [pending.cell for pending in plan.pending]) == ([CELL], [broken], [new])
    assert plan.pending[0].env_steps == 0
    retried = make_plan(chosen, tmp_path, retry_failed=True).pending
    assert [pending.cell for pending in retried] == [broken, new]
    assert 0 < retried[0].env_steps < 200  # from its checkpoint


def test_another_configuration_is_refused_with_the_difference(tmp_path: Path) -> None:
    sweep([CELL], tmp_path)
    with pytest.raises(UserError, match="episodes: stored 4, requested 5") as caught:
        make_plan(resolve_cells(cells(2, overrides=("evaluations=4", "episodes=5"))), tmp_path)
    assert CELL.name in str(caught.value)
    assert str(caught.value).count("\n") <= 1
    with pytest.raises(UserError, match="steps: stored 200, requested 300"):
        make_plan(resolve_cells(cells(1, steps=300)), tmp_path)
    assert make_plan(resolve_cells(cells(1, profile="quick")), tmp_path).done


def test_cells_of_another_version_of_their_task_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweep([CELL], tmp_path)
    monkeypatch.setattr(ToyReach, "version", 2)
    with pytest.raises(UserError, match="version of task 'toy_reach': stored 1, requested 2"):
        make_plan(resolve_cells(cells(1)), tmp_path)
