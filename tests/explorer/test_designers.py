"""What a policy's designer becomes in a page follows from the policy, and its error is measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from builders import VERSION_0_1_0
from codesign_bench.explorer.designers import (
    ACCURACY,
    DesignGrid,
    NetworkDesigner,
    OneDesign,
    designer_of,
    first_look,
    played,
    probes_of,
)
from codesign_bench.explorer.functions import fit
from codesign_bench.explorer.goals import Goals
from codesign_bench.method import Array, Policy
from codesign_bench.storage.policies import load_policy
from codesign_bench.task import Singles, load_task

GOALS = Goals.of(load_task("push"))
PUSH = VERSION_0_1_0 / "push"


def designer(policy: Policy) -> NetworkDesigner | OneDesign | DesignGrid:
    """Return the designer of a policy on push."""
    observations = fit(lambda points: first_look(GOALS, points).astype(np.float64), GOALS)
    probes = probes_of(GOALS)
    return designer_of(policy, GOALS, observations, probes, first_look(GOALS, probes))


def cell(method: str) -> Path:
    """Return the folder of a method's cell."""
    return PUSH / method / "default" / "seed-00"


def test_a_network_is_exported_and_agrees_with_the_policy() -> None:
    policy = load_policy(cell("gnn_ppo"))
    found = designer(policy)
    assert isinstance(found, NetworkDesigner)
    assert found.error < ACCURACY
    points = GOALS.random_points(np.random.default_rng(2), 20)
    seen = first_look(GOALS, points)
    mine = [found.program(row) for row in seen]
    np.testing.assert_allclose(mine, played(policy, seen), atol=1e-4)


@pytest.mark.parametrize("method", ["cma_rl", "cma_es"])
def test_a_method_with_one_tool_gives_one_design(method: str) -> None:
    policy = load_policy(cell(method))
    found = designer(policy)
    assert isinstance(found, OneDesign)
    np.testing.assert_allclose(found.design, played(policy, first_look(GOALS, GOALS.recorded(4)))[0], atol=1e-6)


class Straight(Policy):
    """Designs that are linear in the goal, without a network."""

    def design(self, observation: Singles) -> Singles:
        goal = GOALS.task.layout.split(observation).goal
        designs: Singles = np.repeat((goal[..., :1] - 16.0) / 20.0, 5, axis=-1).astype(np.float32)
        return designs

    def act(self, observation: Singles) -> Singles:
        raise NotImplementedError

    def tensors(self) -> dict[str, Array]:
        return {}


def test_any_other_designer_is_interpolated_on_a_grid() -> None:
    found = designer(Straight())
    assert isinstance(found, DesignGrid)
    assert found.error < 1e-6, "linear interpolation of a linear function"
    assert found(np.array([[16.0, 8.0], [21.0, 9.0]]))[:, 0] == pytest.approx([0.0, 0.25])
