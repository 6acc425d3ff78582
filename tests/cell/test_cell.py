"""A cell is a value: its place on disk, what it is asked to learn and how it is configured follow from it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builders import toy_cells
from codesign_bench.cell.cell import Cell, resolve_cell, resolve_cells
from codesign_bench.cell.variant import Variant
from codesign_bench.errors import UserError
from codesign_bench.task.episodes import Tradeoff

pytestmark = pytest.mark.usefixtures("toy")


def test_its_folder_follows_from_task_method_variant_and_seed() -> None:
    cell = Cell("push", "gnn_ppo", 3, Variant.of(alpha=0.3, cutout=0.4), profile="quick", steps=10)
    assert cell.name == "push/gnn_ppo/cutout-0.40_alpha-0.30/seed-03"
    assert cell.folder(Path("runs")) == Path("runs", *cell.name.split("/"))
    assert Cell("push", "gnn_ppo", 0).name == "push/gnn_ppo/default/seed-00"


@pytest.mark.parametrize(
    "cell",
    [
        Cell("push", "gnn_ppo", 0),
        Cell("scoop", "mine", 12, Variant.of(finetune=2), "quick", 5_000, ("epochs=2", "mine.rate=1e-3")),
    ],
)
def test_a_cell_travels_as_a_line_of_json(cell: Cell) -> None:
    line = cell.to_json()
    assert "\n" not in line
    assert Cell.from_json(line) == cell
    assert hash(Cell.from_json(line)) == hash(cell)


def test_fine_tuning_starts_from_the_cell_that_varies_all_else() -> None:
    given = {"steps": None, "overrides": ("epochs=2",), "profile": "quick"}
    varied = [Variant.of(cutout=0.5, finetune=1), Variant.of(scratch=2), Variant.of(cutout=0.5)]
    fine_tuned, from_scratch, before = toy_cells(variants=varied, **given)
    assert fine_tuned.pretrained == before
    assert from_scratch.pretrained is None
    assert before.pretrained is None


def test_a_resolved_cell_has_its_task_its_method_and_its_configuration() -> None:
    resolved = resolve_cell(Cell("toy_reach", "toy_search", 0, steps=70, overrides=("episodes=3",)))
    assert (resolved.task.name, resolved.method_class.name) == ("toy_reach", "toy_search")
    assert (resolved.config.run.steps, resolved.config.method.episodes) == (70, 3)
    assert resolved.config.sources["run.steps"] == "--steps"


def test_every_axis_of_a_variant_changes_the_problem() -> None:
    (cell,) = toy_cells(variants=[Variant.of(cutout=0.5, alpha=0.3)], overrides=("tradeoff_scale=2",))
    problem = resolve_cell(cell).problem()
    assert (problem.cutout, problem.tradeoff) == (0.5, Tradeoff(0.3, 2.0))
    assert (problem.sample_instances(np.random.default_rng(0), 100) >= 0.5).all()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"task": "pull"}, "unknown task 'pull'"),
        ({"method": "guess"}, "unknown method 'guess'"),
        ({"profile": "weekend"}, "unknown profile 'weekend'"),
        ({"overrides": ("speed=1",)}, "--set speed=1: unknown key 'speed'"),
        ({"overrides": ("gnn_ppo.epochs=1",)}, "'gnn_ppo' is not a selected method"),
        ({"variant": Variant.of(alpha=2.0)}, "--variant alpha=2.0: expected a number from 0 to 1"),
    ],
)
def test_what_cannot_be_is_refused_whichever_cell_it_is(change: dict[str, Any], told: str) -> None:
    fine = {"task": "toy_reach", "method": "toy_search", "seed": 0}
    with pytest.raises(UserError, match=told):
        resolve_cells([Cell(**fine), Cell(**{**fine, **change})])  # type: ignore[arg-type]


def test_an_override_may_mean_one_of_several_methods() -> None:
    cells = [Cell("toy_reach", method, 0, overrides=("gnn_ppo.epochs=2",)) for method in ("gnn_ppo", "toy_search")]
    graph, search = resolve_cells(cells)
    assert graph.config.method.epochs == 2
    assert search.config.sources["method.episodes"] == "default"
