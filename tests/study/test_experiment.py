"""Experiments say as data which cells they need, in stages, each cell once."""

from __future__ import annotations

from dataclasses import replace

from codesign_bench.cell.variant import Variant
from codesign_bench.study import Experiment, Grid, stages_of

DEFAULTS = Grid(("push", "scoop"), ("a", "b"), (100, 101, 102))
STARTS = replace(DEFAULTS, variants=(Variant.of(finetune=1), Variant.of(scratch=1)))


def test_a_grid_has_the_seeds_of_the_study_or_as_many_as_a_profile_allows() -> None:
    assert {cell.seed for cell in DEFAULTS.cells("laptop")} == {100, 101, 102}
    assert {cell.seed for cell in DEFAULTS.cells("quick")} == {100}
    assert len(DEFAULTS.cells("laptop")) == 2 * 2 * 3


def test_asked_for_more_seeds_than_the_study_has_the_next_ones_follow() -> None:
    assert {cell.seed for cell in DEFAULTS.cells("quick", 2)} == {100, 101}
    assert sorted({cell.seed for cell in DEFAULTS.cells("laptop", 5)}) == [100, 101, 102, 103, 104]


def test_seeds_may_differ_from_task_to_task() -> None:
    cells = replace(DEFAULTS, seeds={"push": (0, 1), "scoop": (0,)}).cells("laptop")
    assert [sum(cell.task == task for cell in cells) for task in ("push", "scoop")] == [4, 2]


def test_cells_that_several_experiments_need_are_run_once_and_in_their_stage() -> None:
    one, two = Experiment((), "ours", ((DEFAULTS,), (STARTS,))), Experiment((), "ours", ((DEFAULTS,),))
    first, second = stages_of([one, two], "laptop")
    assert len(first) == len(set(first)) == 2 * 2 * 3
    assert len(second) == 2 * len(first)
    assert {cell.pretrained for cell in second} - {None} == set(first)
