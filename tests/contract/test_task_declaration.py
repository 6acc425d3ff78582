"""Each check of what a task declares finds the fault that it is there for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench import registry
from codesign_bench.contract import Check, ask
from codesign_bench.contract import task_declaration as checks
from codesign_bench.task import Box, Constant, PlanarPart, Task, ToolGraph
from contract_faults import FaultsOf, text_of
from sound import SoundReach, changed_task


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.spaces_fit, {"goal_size": 2}, "goal_size is 2, and an instance has 1 entries"),
        (checks.spaces_fit, {"horizon": 0}, "horizon is 0"),
        (checks.spaces_fit, {"state_space": Box.of(tip=(2.0, -2.0, "m"))}, "state_space: tip ranges from 2.0 to -2.0"),
        (checks.spaces_fit, {"tool_graph": ToolGraph(2, ((0, 1),), (0, 1))}, "2 entries, and a design 1"),
        (checks.spaces_fit, {"tool_graph": ToolGraph(1, ((0, 1),), (0,))}, "names nodes [1] of 1"),
        (checks.names_differ, {"state_space": Box.of(goal=(-2.0, 2.0, "m"))}, "'goal' names 2 entries"),
        (checks.docstring_is_complete, {"__doc__": "A stick."}, "lacks: Action space, Observation, Goal space"),
        (checks.docstring_is_complete, {"__doc__": SoundReach.__doc__.replace("1: ", "2: ")}, "lacks: 'Design, 1: '"),
        (checks.scene_has_sources, {"scene": {}}, "`scene` is empty"),
        (checks.scene_has_sources, {"scene": {"MASS": Constant(1.0, "kg", "", "")}}, "no source: MASS"),
        (checks.material_and_effort_are_fractions, {"material": lambda self, designs: 2.0 * designs[:, 0]}, "to 2"),
        (
            checks.material_and_effort_are_fractions,
            {"effort": lambda self, controls: controls[:, 0]},
            "is from -1 to 1",
        ),
        (checks.material_and_effort_are_fractions, {"effort": lambda self, controls: np.ones(len(controls))}, "still"),
        (
            checks.material_and_effort_are_fractions,
            {"material": lambda self, d: np.ones(len(d))},
            "smallest tool uses 1",
        ),
        (checks.tool_parts_follow_the_design, {"tool_parts": lambda self, design: ()}, "0 parts"),
        (
            checks.tool_parts_follow_the_design,
            {"tool_parts": lambda self, design: (PlanarPart((0.0, 0.0), (1.0, 0.0), 0.1),)},
            "two random designs have the same parts",
        ),
        (checks.tool_parts_follow_the_design, {"tool_parts": Task.tool_parts}, "it does not define `tool_parts`"),
    ],
)
def test_what_is_wrong_is_found(task_faults: FaultsOf, check: Check[Task], changes: dict[str, Any], found: str) -> None:
    assert found in task_faults(check, **changes)


@pytest.mark.parametrize(
    ("task_class", "found"),
    [
        (changed_task(name="other"), "its name is 'other'"),
        (type("Empty", (SoundReach,), {"effort": Task.effort, "__abstractmethods__": frozenset({"effort"})}), "effort"),
        (
            type("Bare", (Task,), dict.fromkeys(("material", "effort", "make_simulator"), lambda self: None)),
            "no `name`",
        ),
    ],
    ids=["name", "abstract", "bare"],
)
def test_a_task_that_cannot_be_used_says_what_is_missing(toy: None, task_class: type[Task], found: str) -> None:
    registry.register("tasks", "asked", lambda: task_class)
    assert found in text_of(ask(checks.loads, "asked"))


def test_all_corners_of_few_entries_and_some_of_many() -> None:
    assert sorted(map(tuple, checks.corners(2).tolist())) == [(-1, -1), (-1, 1), (1, -1), (1, 1)]
    assert checks.corners(30).shape == (4096, 30)
    assert set(np.abs(checks.corners(30)).ravel()) == {1.0}
