"""Fixtures that the tests of the report share."""

from __future__ import annotations

import pytest

from codesign_bench.storage.records import FAILED, RUNNING, Failure
from reports import ATTACK, make_cell, report


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the page on three finished cells, one that failed, one that was interrupted, and a damaged one."""
    out = tmp_path_factory.mktemp("report") / "runs"
    for seed, final in enumerate((1.0, 2.0, 6.0)):
        make_cell(out, seed, returns=(0.0, final), label=ATTACK)
    make_cell(out, 3, status=FAILED, failure=Failure(f"it broke: {ATTACK}", f"File {ATTACK}"))
    make_cell(out, 4, returns=(0.0,), status=RUNNING)
    (make_cell(out, 5) / "cell.json").write_text("{")
    return report(out)
