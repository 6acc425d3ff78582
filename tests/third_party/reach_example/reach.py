"""Reach: a single link turns about its held end until its tip is at the goal. Docstring of `Reach` has the details.

Shapes: `b` the slots of a call, `O` observation, `I` = 2 instance (goal distance, bearing), `D` = 1 design, `C` = 1
control.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np

from codesign_bench.task import (
    OURS,
    Behaviour,
    Box,
    Floats,
    Given,
    Layout,
    PlanarPart,
    Simulator,
    Singles,
    Slots,
    Task,
    ToolGraph,
    ToolPart,
    constants,
)

MAX_TURN_RATE: Annotated[float, Given("rad/s", OURS)] = 2.0
"""Largest turning rate of the link."""
MAX_HEADING: Annotated[float, Given("rad", OURS)] = 3.0
"""Largest angle of the link to either side."""
LINK_RADIUS: Annotated[float, Given("m", OURS)] = 0.02
"""Half the thickness of the link."""
CONTROL_PERIOD: Annotated[float, Given("s", OURS)] = 0.1
"""Duration of a control step."""
GOAL_RADIUS: Annotated[float, Given("m", OURS)] = 0.1
"""The tip must come within this distance of the goal."""
SUCCESS_REWARD: Annotated[float, Given("1", OURS)] = 1.0
"""Added once, when the tip is at the goal."""

DESIGN = Box.of(length=(0.4, 1.6, "m"))
CONTROL = Box.of(turn_rate=(-MAX_TURN_RATE, MAX_TURN_RATE, "rad/s"))
INSTANCE = Box.of(goal_distance=(0.5, 1.5, "m"), goal_bearing=(-2.5, 2.5, "rad"))
STATE = Box.of(heading=(-MAX_HEADING, MAX_HEADING, "rad"), tip_x=(-1.6, 1.6, "m"), tip_y=(-1.6, 1.6, "m"))
LENGTH, TURN_RATE = DESIGN.index("length"), CONTROL.index("turn_rate")
DISTANCE, BEARING = INSTANCE.index("goal_distance"), INSTANCE.index("goal_bearing")
HEADING, TIP = STATE.index("heading"), STATE.slice("tip_x", "tip_y")


class Reach(Task):
    """Touch the goal with the tip of a one-link tool that turns about its held end: only one length fits each goal.

    Action space
        Design, 1: length of the link (m). Control, 1: turning rate (rad/s).

    Observation
        State, 3: heading of the link (rad) and place of its tip x, y (m). Goal, 2: its distance from the held end (m)
        and its bearing (rad). Then the design and the phase.

    Goal space
        Distances and bearings, uniform.

    Reward
        The decrease of the tip's distance from the goal, and a bonus on success.

    Starting state
        The link points along the x axis.

    Episode end
        Success when the tip is close enough to the goal, or the time limit.
    """

    name = "reach"
    title = "Reach"
    horizon = 30
    control_period = CONTROL_PERIOD
    design_space = DESIGN
    tool_graph = ToolGraph(num_nodes=1, edges=(), parameter_nodes=(0,))
    control_space = CONTROL
    instance_space = INSTANCE
    goal_size = 2
    state_space = STATE
    reward_terms: ClassVar = {
        "progress": "d_before - d_after, d the distance from tip to goal, m",
        "success": f"{SUCCESS_REWARD:g} in the step that solves the task",
    }
    success_conditions: ClassVar = {"at_goal": f"the tip is within {GOAL_RADIUS:g} m of the goal"}
    scene: ClassVar = constants(__name__)
    num_evaluation_instances = 32

    def material(self, designs: Floats) -> Floats:
        """Return the length as a fraction of the longest link, for designs (b, D) in m."""
        share: Floats = designs[:, LENGTH] / self.design_space.high[LENGTH]
        return share

    def effort(self, controls: Floats) -> Floats:
        """Return the turning rate as a fraction of the largest, for controls (b, C) in [-1, 1]."""
        share: Floats = np.abs(controls[:, TURN_RATE])
        return share

    def tool_parts(self, design: Floats) -> tuple[ToolPart, ...]:
        """Return the one link of a design (D,) in m."""
        return (PlanarPart((0.0, 0.0), (float(design[LENGTH]), 0.0), LINK_RADIUS),)

    def script(self) -> Behaviour:
        """Return a script whose link is as long as the goal's distance and turns directly to it."""
        return _Script(self.layout)

    def make_simulator(self, num_slots: int) -> Simulator:
        """Return a simulator of `num_slots` links."""
        return _ReachSimulator(num_slots)


class _Script(Behaviour):
    def __init__(self, layout: Layout) -> None:
        self.layout = layout

    def design(self, observation: Singles) -> Singles:
        """Return the design (D,) or (b, D) for an observation (O,) or (b, O)."""
        goal = self.layout.split(observation).goal
        return DESIGN.to_unit(goal[..., [DISTANCE]]).astype(np.float32)

    def act(self, observation: Singles) -> Singles:
        """Return the control (C,) or (b, C) for an observation (O,) or (b, O)."""
        seen = self.layout.split(observation)
        turn = seen.goal[..., [BEARING]] - seen.state[..., [HEADING]]
        return np.clip(turn / (MAX_TURN_RATE * CONTROL_PERIOD), -1.0, 1.0).astype(np.float32)


class _ReachSimulator(Simulator):
    """All slots at once in numpy; a scene without a tool has a link of length 0."""

    def __init__(self, num_slots: int) -> None:
        super().__init__(num_slots, STATE.size)
        self.heading = np.zeros(num_slots)
        self.length = np.zeros(num_slots)
        self.goal = np.zeros((num_slots, 2))
        self.distance = np.zeros(num_slots)

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Point the links along the x axis; put the goals at `instances` (b, I)."""
        self.forget(slots)
        self.heading[slots] = 0.0
        self.length[slots] = 0.0
        self.goal[slots] = _point(instances[:, DISTANCE], instances[:, BEARING])
        self._observe(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Give the links the lengths `designs` (b, D), in m."""
        self.length[slots] = designs[:, LENGTH]
        self._observe(slots)

    def step(self, slots: Slots, controls: Floats) -> None:
        """Turn the links by `controls` (b, C) for one control step and reward the tips' progress."""
        turn = controls[:, TURN_RATE] * MAX_TURN_RATE * CONTROL_PERIOD
        self.heading[slots] = np.clip(self.heading[slots] + turn, -MAX_HEADING, MAX_HEADING)
        before = self.distance[slots]
        self._observe(slots)
        self.set_success(slots, at_goal=self.distance[slots] < GOAL_RADIUS)
        self.set_reward(slots, progress=before - self.distance[slots], success=SUCCESS_REWARD * self.success[slots])

    def _observe(self, slots: Slots) -> None:
        tip = _point(self.length[slots], self.heading[slots])
        self.distance[slots] = np.linalg.norm(tip - self.goal[slots], axis=1)
        self.state[slots, HEADING] = self.heading[slots]
        self.state[slots, TIP] = tip


def _point(distance: Floats, bearing: Floats) -> Floats:
    """Return the points (b, 2) at distances (b,), m, and bearings (b,), rad, from the held ends."""
    point: Floats = distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
    return point
