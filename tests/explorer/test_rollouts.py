"""Recorded episodes are those that evaluation plays, and their frames are the scenes on the way."""

from __future__ import annotations

import numpy as np
import pytest

from builders import offered
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.explorer.rollouts import Structures, draws, poses, record, stride_of, view_of
from codesign_bench.method import Array, Policy
from codesign_bench.task import Singles, load_task, task_names
from codesign_bench.task.episodes import Episodes
from toy import ToyReach

PUSH = load_task("push")


class Script(Policy):
    """A task's script as a policy."""

    def __init__(self) -> None:
        self.script = PUSH.script()

    def design(self, observation: Singles) -> Singles:
        return self.script.design(observation)

    def act(self, observation: Singles) -> Singles:
        return self.script.act(observation)

    def tensors(self) -> dict[str, Array]:
        return {}


def test_a_recording_is_what_evaluation_plays() -> None:
    instances = PUSH.evaluation_instances()[:3]
    structures = Structures()
    recording = record(PUSH, Script(), instances, structures)
    evaluation = evaluate(PUSH, Script(), instances=instances)
    np.testing.assert_array_equal(recording.successes, evaluation.successes)
    np.testing.assert_array_equal(recording.returns, evaluation.returns)
    np.testing.assert_array_equal(recording.lengths, evaluation.lengths)
    np.testing.assert_array_equal(recording.designs, evaluation.unit_designs)
    stride = stride_of(PUSH)
    assert [len(frames) for frames in recording.frames] == [1 + -(-length // stride) for length in recording.lengths]
    # The goal's ring comes first, at rest; the puck ends near it where the episode is solved.
    solved = int(np.flatnonzero(recording.successes)[0])
    first, last = recording.frames[solved][0], recording.frames[solved][-1]
    np.testing.assert_allclose([first[:2], last[:2]], [instances[solved]] * 2)
    assert np.hypot(last[3] - last[0], last[4] - last[1]) < 1.5 < np.hypot(first[3] - first[0], first[4] - first[1])
    assert len(structures.to_json()) == 1, "nothing changes but poses"


@pytest.mark.parametrize("name", task_names())
def test_a_sketch_has_the_tool_and_a_pose_for_every_item(name: str) -> None:
    task = load_task(name)
    episodes, slot = Episodes(task, 1), np.arange(1)
    episodes.begin(slot, task.evaluation_instances()[:1])
    episodes.design(slot, np.zeros((1, task.design_space.size)))
    sketch = offered(lambda: episodes.simulator.sketch(0))
    assert {len(item.pose) for item in sketch.items} <= {0, 3, 7}
    assert len(sketch.tool_pose) in (3, 7)
    assert np.isfinite(poses(sketch)).all()
    assert view_of(sketch)


@pytest.mark.parametrize(("name", "body"), [("fetch_cube", -1), ("lift_cup", -1)])
def test_a_body_in_space_is_where_the_simulator_has_it(name: str, body: int) -> None:
    task = load_task(name)
    episodes, slot = Episodes(task, 1), np.arange(1)
    episodes.begin(slot, task.evaluation_instances()[:1])
    episodes.design(slot, np.zeros((1, task.design_space.size)))
    sketch = episodes.simulator.sketch(0)
    bodies = [item for item in sketch.items if len(item.pose) == 7]
    np.testing.assert_allclose(bodies[body].pose, episodes.simulator.bodies[0, 0, :7])  # type: ignore[attr-defined]
    extents = [shape.size for item in bodies for shape in item.shapes]
    assert np.min(extents) > 0.0
    assert {shape.kind for item in sketch.items for shape in item.shapes} <= {"box", "line", "dot"}


def test_a_task_without_sketches_is_recorded_without_frames() -> None:
    assert not draws(ToyReach())
    assert draws(PUSH)
    recording = record(PUSH, Script(), PUSH.evaluation_instances()[:1], None)
    assert recording.frames == [[]]
