"""Reach: a single link turns about its held end until its tip is at the goal. Docstring of `Reach` has the details.

Shapes: `B` slots, `b` the slots a call names, `I` = 2 instance (goal distance, bearing), `D` = 1 design, `C` = 1
control.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Box, Floats, Simulator, Slots, Task, ToolGraph

MAX_TURN_RATE = 2.0
"""rad/s."""
CONTROL_PERIOD = 0.1
"""s."""
GOAL_RADIUS = 0.1
"""The tip must come within this distance of the goal, m."""


class Reach(Task):
    """Touch the goal with the tip of a one-link tool that turns about its held end: only one length fits each goal.

    Action space
        Design, 1: length of the link, 0.4 to 1.6 m. Control, 1: turning rate, +-2 rad/s.

    Observation
        Heading of the link (rad) and position of its tip (m); goal distance (m) and bearing (rad); design; phase.

    Reward
        Distance from tip to goal that the step gained, in m; +1 on success.

    Starting state
        The link points along the x axis.

    Episode end
        Success: the tip is within 0.1 m of the goal. Time limit: 30 control steps of 0.1 s.
    """

    name = "reach"
    title = "Reach"
    horizon = 30
    control_period = CONTROL_PERIOD
    design_space = Box.of(length=(0.4, 1.6, "m"))
    tool_graph = ToolGraph(num_nodes=1, edges=(), parameter_nodes=(0,))
    control_space = Box.of(turn_rate=(-MAX_TURN_RATE, MAX_TURN_RATE, "rad/s"))
    instance_space = Box.of(goal_distance=(0.5, 1.5, "m"), goal_bearing=(-2.5, 2.5, "rad"))
    goal_size = 2
    state_space = Box.of(heading=(-3.0, 3.0, "rad"), tip_x=(-1.6, 1.6, "m"), tip_y=(-1.6, 1.6, "m"))
    num_evaluation_instances = 32

    def material(self, designs: Floats) -> Floats:
        """Return the used share of the longest link for designs (b, D) in m."""
        share: Floats = designs[:, 0] / self.design_space.high[0]
        return share

    def effort(self, controls: Floats) -> Floats:
        """Return the share of the largest turning rate for controls (b, C) in [-1, 1]."""
        share: Floats = np.abs(controls[:, 0])
        return share

    def make_simulator(self, num_slots: int) -> Simulator:
        """Return a simulator of `num_slots` links."""
        return _ReachSimulator(num_slots, self.state_space.size)


class _ReachSimulator(Simulator):
    """All slots at once in numpy; a scene without a tool has a link of length 0."""

    def __init__(self, num_slots: int, state_size: int) -> None:
        super().__init__(num_slots, state_size)
        self.heading = np.zeros(num_slots)
        self.length = np.zeros(num_slots)
        self.goal = np.zeros((num_slots, 2))
        self.distance = np.zeros(num_slots)

    def begin(self, slots: Slots, instances: Floats) -> None:
        """Point the links along the x axis; put the goals where `instances` (b, I) say."""
        self.heading[slots] = 0.0
        self.length[slots] = 0.0
        self.reward[slots] = 0.0
        self.success[slots] = False
        self.goal[slots] = _point(instances[:, 0], instances[:, 1])
        self._observe(slots)

    def build(self, slots: Slots, designs: Floats) -> None:
        """Give the links the lengths `designs` (b, D), in m."""
        self.length[slots] = designs[:, 0]
        self._observe(slots)

    def step(self, slots: Slots, controls: Floats) -> None:
        """Turn the links by `controls` (b, C) for one control step and reward the tips' progress."""
        turn = controls[:, 0] * MAX_TURN_RATE * CONTROL_PERIOD
        self.heading[slots] = np.clip(self.heading[slots] + turn, -3.0, 3.0)
        before = self.distance[slots]
        self._observe(slots)
        self.success[slots] = self.distance[slots] < GOAL_RADIUS
        self.reward[slots] = before - self.distance[slots] + self.success[slots]

    def _observe(self, slots: Slots) -> None:
        tip = _point(self.length[slots], self.heading[slots])
        self.distance[slots] = np.linalg.norm(tip - self.goal[slots], axis=1)
        self.state[slots, 0] = self.heading[slots]
        self.state[slots, 1:] = tip


def _point(distance: Floats, bearing: Floats) -> Floats:
    point: Floats = distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
    return point
