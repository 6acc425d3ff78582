"""Tools in a page are the task's: every presented task has a model, and a tool that bends has none."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.explorer.tools import tool_model, tool_values
from codesign_bench.registry import presented
from codesign_bench.task import Floats, PlanarPart, ToolPart, load_task, usable_tasks
from toy import ToyReach


@pytest.mark.parametrize("name", usable_tasks(presented("tasks")))
def test_the_model_of_a_task_gives_its_parts(name: str) -> None:
    task = load_task(name)
    model = tool_model(task)
    assert model is not None
    designs = np.random.default_rng(11).uniform(-1.0, 1.0, (20, task.design_space.size))
    kind, values = tool_values(task, designs)
    assert model.kind == kind
    np.testing.assert_allclose(model(designs), values, atol=1e-7)


class _Bent(ToyReach):
    """A stick whose tip is a square of its length away."""

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        return (PlanarPart((0.0, 0.0), (float(design[0] ** 2), 0.0), 0.1),)


def test_a_tool_of_another_kind_has_no_model() -> None:
    assert tool_model(_Bent()) is None
    assert tool_model(ToyReach()) is None, "it does not define its parts"
