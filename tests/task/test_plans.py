"""A plan is a design, then the controls of one step after the other."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import load_task
from codesign_bench.task.plans import controls_of, designs_of, plan_size


@pytest.mark.parametrize("leading", [(), (3,), (2, 3)])
def test_designs_and_controls_of_push_by_hand(leading: tuple[int, ...]) -> None:
    task = load_task("push")
    size, design, control = plan_size(task), task.design_space.size, task.control_space.size
    assert size == design + task.horizon * control
    plans = np.zeros(leading, dtype=int)[..., None] + np.arange(size)
    assert designs_of(task, plans).shape == (*leading, design)
    assert designs_of(task, plans)[(0,) * len(leading)].tolist() == list(range(design))
    controls = controls_of(task, plans)
    assert controls.shape == (*leading, task.horizon, control)
    assert controls[(0,) * len(leading)][1].tolist() == list(range(design + control, design + 2 * control))
