"""Which cells a page shows, and which it leaves out and why."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders import VERSION_0_1_0, store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.explorer.gather import Choice, chosen_cells


def test_finished_cells_of_the_default_variant_are_chosen() -> None:
    lines: list[str] = []
    cells = chosen_cells(VERSION_0_1_0, Choice(tasks=("push", "fetch_cube")), lines.append)
    assert list(cells) == ["push", "fetch_cube"]
    assert {cell.record.variant.name for of_task in cells.values() for cell in of_task} == {"default"}
    names = [(cell.record.method, cell.record.seed) for cell in cells["push"]]
    assert names == sorted(names, key=lambda name: (["gnn_ppo", "cma_rl", "cma_es"].index(name[0]), name[1]))


def test_methods_and_seeds_can_be_chosen() -> None:
    cells = chosen_cells(VERSION_0_1_0, Choice(("push",), ("cma_es",), (1,)), [].append)
    assert [(cell.record.method, cell.record.seed) for cell in cells["push"]] == [("cma_es", 1)]


def test_cells_that_cannot_be_shown_are_named(tmp_path: Path) -> None:
    store_cell(tmp_path, seed=0)
    store_cell(tmp_path, seed=1, variant=Variant.of(alpha=0.3))
    lines: list[str] = []
    with pytest.raises(UserError, match=r"no cell of this choice .* has a policy"):
        chosen_cells(tmp_path, Choice(), lines.append)
    assert lines == [f"left out: 1 cell without a policy in '{tmp_path}'"]
    with pytest.raises(UserError, match="no finished cell of this choice"):
        chosen_cells(tmp_path, Choice(tasks=("scoop",)), lines.append)
