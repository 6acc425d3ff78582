"""The shipped results are complete, and a shipped policy does what its curve says."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

import codesign_bench as cb
from codesign_bench.config import differences, resolve
from codesign_bench.evaluate import evaluate
from codesign_bench.method import load_method
from codesign_bench.results import read_cell

REFERENCE = Path(__file__).resolve().parent.parent / "results" / "reference"
METHODS: tuple[str, ...] = import_module("codesign_bench.methods").ORDER

pytestmark = pytest.mark.skipif(not REFERENCE.exists(), reason="a source distribution leaves the results out")


def test_every_method_has_six_finished_seeds_on_push() -> None:
    frame = cb.load_results(REFERENCE)
    seeds = frame[frame["task"] == "push"].groupby("method")["seed"].nunique()
    assert seeds.to_dict() == dict.fromkeys(METHODS, 6)
    last = frame.groupby(["method", "seed"])["env_steps"].max()
    assert (last >= 1_000_000).all()


FIRST_SEEDS = sorted(path.parent for path in REFERENCE.glob("*/*/default/seed-00/cell.json"))


@pytest.mark.parametrize("folder", FIRST_SEEDS, ids=lambda folder: "-".join(folder.parts[-4:-2]))
def test_a_shipped_policy_gets_the_shipped_return(folder: Path) -> None:
    task, method = folder.parts[-4:-2]
    frame = cb.load_results(REFERENCE)
    cell = (
        (frame["task"] == task) & (frame["method"] == method) & (frame["variant"] == "default") & (frame["seed"] == 0)
    )
    rows = frame[cell].sort_values("env_steps")
    evaluation = evaluate(cb.load_task(task), cb.load_policy(folder))
    # Another processor rounds otherwise, and contact makes more of it: a few of 128 episodes may then end otherwise.
    value = rows["return_mean"].iloc[-1]
    assert evaluation.summary["return_mean"] == pytest.approx(value, abs=0.1 * max(1.0, abs(value)))
    assert evaluation.summary["success_rate"] == pytest.approx(rows["success_rate"].iloc[-1], abs=0.06)


@pytest.mark.parametrize("folder", FIRST_SEEDS, ids=lambda folder: "-".join(folder.parts[-4:-2]))
def test_the_default_profile_is_what_the_shipped_cells_were_run_with(folder: Path) -> None:
    task, method = folder.parts[-4:-2]
    stored = read_cell(folder)
    assert stored is not None
    assert differences(stored["config"], resolve(load_method(method), task, "laptop", [])) == []
