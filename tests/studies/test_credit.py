"""The study of the design's credit: two architectures times two credits, with everything else equal."""

from __future__ import annotations

from itertools import groupby

import pytest

from codesign_bench.cell.cell import Cell, resolve_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.study import load_study, stages_of

STUDY = load_study("credit")
(CELLS,) = stages_of(list(STUDY.experiments.values()), "laptop")


def test_every_architecture_meets_every_credit_on_every_task_and_seed() -> None:
    assert len(CELLS) == len(set(CELLS)) == 2 * 2 * 6 * 3
    assert {cell.variant.name for cell in CELLS} == {"credit-joint", "credit-separate"}


def test_tuning_seeds_decide() -> None:
    assert {cell.seed for cell in CELLS} <= set(range(10))


def test_two_cells_of_one_method_task_and_seed_differ_only_in_the_credit() -> None:
    def problem(cell: Cell) -> tuple[str, str, int]:
        return cell.task, cell.method, cell.seed

    for _, pair in groupby(sorted(CELLS, key=problem), key=problem):
        first, second = (resolve_cell(cell).config for cell in pair)
        assert first.run == second.run
        different = {name for name, value in vars(first.method).items() if value != vars(second.method)[name]}
        assert different == {"design_credit"}


def test_an_unknown_credit_is_refused() -> None:
    with pytest.raises(UserError, match="--set design_credit=blame: expected one of joint, separate"):
        resolve_cell(Cell("push", "gnn_ppo", 0, Variant.of(credit="blame")))
