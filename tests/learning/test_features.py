"""Networks see the parts of an observation that they should, and no others."""

from __future__ import annotations

import pytest
import torch

from codesign_bench.learning.features import Features
from codesign_bench.learning.networks import (
    RunningNorm,
)
from codesign_bench.task import load_task

pytestmark = pytest.mark.numeric


def test_features_hand_each_node_its_own_design_parameters() -> None:
    features = Features(load_task("push"))
    layout = features.layout
    observation = torch.arange(float(layout.size))[None]
    start = layout.design.start
    # Lengths are the parameters 0 to 2; the joints' angles, 3 and 4, belong to the links behind them.
    expected = [[start, 0.0], [start + 1.0, start + 3.0], [start + 2.0, start + 4.0]]
    assert features.nodes(observation)[:, 0].tolist() == expected
    assert features.phase(observation)[0].tolist() == [layout.phase.start, layout.phase.start + 1.0]


def test_no_network_sees_the_elapsed_time() -> None:
    features = Features(load_task("push"))
    norm = RunningNorm.over(*features.boxes)
    early = torch.zeros(1, features.layout.size)
    late = early.clone()
    late[0, -1] = 1.0
    assert torch.equal(features.flat(early, norm), features.flat(late, norm))
    assert features.flat(early, norm).shape == (1, features.flat_size)


def test_the_parts_of_an_observation_stand_in_their_places() -> None:
    task = load_task("push")
    features, layout = Features(task), task.layout
    observation = torch.arange(float(2 * layout.size)).view(2, -1)
    first = list(range(layout.goal.stop))
    assert features.task(observation).tolist() == [first, [value + layout.size for value in first]]
    assert (features.size, features.flat_size) == (len(first), len(first) + task.design_space.size + 2)


def test_the_flat_view_is_normalised_state_and_goal_then_design_and_phase_as_they_are() -> None:
    features = Features(load_task("push"))
    norm, layout = RunningNorm.over(*features.boxes), features.layout
    observation = torch.rand(3, layout.size, generator=torch.Generator().manual_seed(0))
    flat = features.flat(observation, norm)
    assert torch.equal(flat[:, : features.size], norm(observation[:, : features.size]))
    assert torch.equal(flat[:, features.size : -2], observation[:, layout.design])
    assert torch.equal(flat[:, -2:], observation[:, layout.phase.start : layout.phase.start + 2])
