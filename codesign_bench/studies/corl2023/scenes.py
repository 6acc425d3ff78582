"""The scenes of the paper's six tasks, as printed in the tables of its appendix; a comment gives each LaTeX label.

Planar tasks measure in world units and degrees, three-dimensional ones in metres and degrees (the paper prints no
units; these are our reading). Kept as printed:

- The planar chain has two angles (section "Tool design space"), yet "Tool Angle Init." lists three entries; so do
  "Tool Angle Min" and "Tool Angle Max" for the three-link box chain, whose 11 parameters leave room for two.
- "Control Action Min/Max" of fetch cube and lift cup bound six numbers, where the text says that the control action
  space is R^3, a change in end-effector position. Scoop 3D has six in both places.
- The box dimensions of scoop 3D have the same smallest and largest second entry: that dimension is fixed.
- "Success Reward" is listed for the three-dimensional tasks only.
"""

from __future__ import annotations

from dataclasses import dataclass

from codesign_bench.studies.corl2023.ranges import Interval, Triple


@dataclass(frozen=True)
class SceneTable:
    """The scene's rows in the tables of all six tasks."""

    tool_position_init: tuple[float, ...]
    """Where the tool's fixed point starts: (x, y) in world units, or (x, y, z) in m."""
    control_steps_per_action: int
    """Simulation steps for which one control action is held."""
    max_episode_steps: int
    """Control steps until the time limit."""
    slack_reward: float
    """Reward added in every step."""


@dataclass(frozen=True, kw_only=True)
class PlanarSceneTable(SceneTable):
    """Scene of a task with the planar three-link chain."""

    tool_length_ratio: Interval
    """Range of the relative change r of a link's length; we read: length = initial length * (1 + r)."""
    tool_length_init: Triple
    """Initial length of each link, in world units."""
    tool_angle_init: Triple
    """Initial relative angles, in degrees; three as printed, for two joints."""
    tool_angle_ratio: Interval
    """Range of the angle's factor r; we read: angle = initial angle + scale * r."""
    tool_angle_scale: float
    """Angle of r = 1, in degrees."""


@dataclass(frozen=True, kw_only=True)
class BoxSceneTable(SceneTable):
    """Scene of a task whose tool is made of boxes."""

    success_reward: float
    """Reward added once, on success."""
    box_dimensions_min: Triple
    """Smallest box dimensions, in m."""
    box_dimensions_max: Triple
    """Largest box dimensions, in m."""
    tool_angle_min: Triple
    """Smallest relative angles, in degrees; three as printed."""
    tool_angle_max: Triple
    """Largest relative angles, in degrees; three as printed."""
    control_action_min: tuple[float, ...]
    """Lower bounds of the control action before scaling: three for position, three for rotation."""
    control_action_max: tuple[float, ...]
    """Upper bounds of the control action before scaling."""
    control_action_scale: float
    """Factor from the control action to the change in end-effector pose."""


PLANAR_SCENES: dict[str, PlanarSceneTable] = {
    # table:our_pushing
    "push": PlanarSceneTable(
        tool_position_init=(20, 10),
        control_steps_per_action=1,
        max_episode_steps=150,
        slack_reward=-0.001,
        tool_length_ratio=(-0.5, 0.5),
        tool_length_init=(2.0, 2.0, 2.0),
        tool_angle_init=(0.0, 0.0, 0.0),
        tool_angle_ratio=(-1.0, 1.0),
        tool_angle_scale=90.0,
    ),
    # table:our_catching
    "catch_balls": PlanarSceneTable(
        tool_position_init=(20, 10),
        control_steps_per_action=1,
        max_episode_steps=150,
        slack_reward=-0.001,
        tool_length_ratio=(-0.5, 2.0),
        tool_length_init=(2.0, 1.0, 1.0),
        tool_angle_init=(0.0, 0.0, 0.0),
        tool_angle_ratio=(-1.0, 1.0),
        tool_angle_scale=60.0,
    ),
    # table:our_scooping
    "scoop": PlanarSceneTable(
        tool_position_init=(15, 10),
        control_steps_per_action=5,
        max_episode_steps=30,
        slack_reward=-0.001,
        tool_length_ratio=(-0.7, 0.2),
        tool_length_init=(6.0, 3.0, 3.0),
        tool_angle_init=(0.0, 0.0, 0.0),
        tool_angle_ratio=(-0.1, 0.7),
        tool_angle_scale=90.0,
    ),
}


BOX_SCENES: dict[str, BoxSceneTable] = {
    # table:our_fetch_cube
    "fetch_cube": BoxSceneTable(
        tool_position_init=(0.0, 0.5, 0.02),
        control_steps_per_action=10,
        max_episode_steps=100,
        slack_reward=-0.001,
        success_reward=10.0,
        box_dimensions_min=(0.005, 0.05, 0.005),
        box_dimensions_max=(0.015, 0.1, 0.02),
        tool_angle_min=(-90.0, -90.0, -90.0),
        tool_angle_max=(90.0, 90.0, 90.0),
        control_action_min=(-1.0, -1.0, -1.0, -0.2, -0.2, -0.2),
        control_action_max=(1.0, 1.0, 1.0, 0.2, 0.2, 0.2),
        control_action_scale=0.1,
    ),
    # table:our_lift_cup
    "lift_cup": BoxSceneTable(
        tool_position_init=(0.0, 1.2, 0.05),
        control_steps_per_action=10,
        max_episode_steps=150,
        slack_reward=-0.001,
        success_reward=10.0,
        box_dimensions_min=(0.005, 0.02, 0.01),
        box_dimensions_max=(0.01, 0.1, 0.03),
        tool_angle_min=(-30.0, -30.0, -30.0),
        tool_angle_max=(30.0, 30.0, 30.0),
        control_action_min=(-1.0, -1.0, -1.0, -1.57, -1.57, -1.57),
        control_action_max=(1.0, 1.0, 1.0, 1.57, 1.57, 1.57),
        control_action_scale=0.1,
    ),
    # table:our_3d_scoop
    "scoop_3d": BoxSceneTable(
        tool_position_init=(0.0, 0.05, 0.1),
        control_steps_per_action=10,
        max_episode_steps=100,
        slack_reward=-0.001,
        success_reward=10.0,
        box_dimensions_min=(0.04, 0.005, 0.02),
        box_dimensions_max=(0.08, 0.005, 0.05),
        tool_angle_min=(-15.0, -15.0, -15.0),
        tool_angle_max=(15.0, 15.0, 15.0),
        control_action_min=(-1.0, -1.0, -1.0, -1.57, -1.57, -1.57),
        control_action_max=(1.0, 1.0, 1.0, 1.57, 1.57, 1.57),
        control_action_scale=0.05,
    ),
}


SCENES: dict[str, SceneTable] = {**PLANAR_SCENES, **BOX_SCENES}

UNUSED: dict[str, str] = dict.fromkeys(
    (f"{name}: tool_angle_init" for name in PLANAR_SCENES),
    "no task uses it: all its entries are zero, and angle = scale * ratio",
)
"""Rows, as "task: row", for which no constant of the task stands, and why."""
