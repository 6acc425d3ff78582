"""Every shipped policy does again what its cell says."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import pytest

from codesign_bench.cell.variant import DEFAULT
from codesign_bench.storage.cells import StoredCell, find_cells
from codesign_bench.storage.policies import misfit
from played_alike import assert_plays_as_stored

RESULTS = Path(__file__).resolve().parents[2] / "results"

if not RESULTS.is_dir():
    pytest.skip("a source distribution leaves the results out", allow_module_level=True)

pytestmark = pytest.mark.reference


def with_policy(*folders: str) -> list[StoredCell]:
    """Return the cells of results folders that have a policy, in the order of their paths."""
    return [cell for folder in folders for cell in find_cells(RESULTS / folder) if cell.has_policy]


SAMPLED = [
    next(cells)
    for _, cells in groupby(
        (cell for cell in with_policy("reference") if cell.record.variant == DEFAULT),
        lambda cell: (cell.record.task, cell.record.method),
    )
]
"""One cell of each task and method; cells come in the order of their folders."""
ONE_PER_TASK = [
    max(cells, key=lambda cell: cell.record.method == "gnn_ppo")
    for _, cells in groupby(SAMPLED, lambda cell: cell.record.task)
]
"""Of each task, one policy, with networks if there is one: CMA-ES's plans need none, which leaves less to round."""
FEW = 32
"""Episodes that tell whether a policy is the one that was judged."""


def name_of(cell: StoredCell) -> str:
    """Return a cell's path below the folder of all results, for the name of a test."""
    return cell.folder.relative_to(RESULTS).as_posix()


@pytest.mark.parametrize(
    "cell",
    [pytest.param(cell, marks=pytest.mark.numeric if cell in ONE_PER_TASK else ()) for cell in SAMPLED],
    ids=name_of,
)
def test_a_shipped_policy_gets_the_shipped_returns(cell: StoredCell) -> None:
    if reason := misfit(cell):
        pytest.skip(reason)
    assert_plays_as_stored(cell, episodes=FEW)


@pytest.mark.slow
@pytest.mark.parametrize("cell", with_policy("reference", "all_methods"), ids=name_of)
def test_a_shipped_policy_gets_the_shipped_returns_in_every_episode(cell: StoredCell) -> None:
    if reason := misfit(cell):
        pytest.skip(reason)
    assert_plays_as_stored(cell)
