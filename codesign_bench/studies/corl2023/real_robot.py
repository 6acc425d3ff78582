"""The paper's evaluation on a real Franka Panda."""

from __future__ import annotations

from dataclasses import dataclass

from codesign_bench.studies.corl2023.ranges import Interval, Triple


@dataclass(frozen=True, kw_only=True)
class RealRobot:
    """The paper's evaluation on a real Franka Panda (section "Evaluation on a real robot" and its appendix).

    Fetch cube's positions are in the robot's frame as printed: m, with the base at the origin and cubes at negative y.
    """

    fetch_cube_starts: tuple[Triple, ...]
    """Start of the cube for which each tool was designed."""
    lift_cup_sizes: tuple[Interval, ...]
    """Scales of length and width, and of height, of the cup for which each tool was designed."""
    trials: int
    """Trials of each tool on its own instance."""
    max_steps: int
    """Control steps until a trial ends without success."""
    grid_shape: tuple[int, int]
    """Rows and columns of the grid of starts on which every fetch-cube tool is tried."""
    grid_extent: Interval
    """Along the rows' and the columns' direction, m: every 6 cm and every 28.53 cm."""
    near_miss: float
    """A cube within this distance of success counts as a near miss, m."""
    fetch_cube_distance: float
    """The cube is fetched when its centre is nearer to the base, m."""
    lift_cup_height: float
    """The cup is lifted when it is higher above the table, m."""
    own_successes: dict[str, tuple[int, ...]]
    """Trials that succeeded by tool, of `trials`."""
    grid_successes: tuple[int, ...]
    """Successful starts of the grid by fetch-cube tool."""


# tab:real_exp, tab:real_fetchcube, tab:real_liftcup, fig:detailed_other_inits_results and the text around them
REAL_ROBOT = RealRobot(
    fetch_cube_starts=(
        (-0.110, -0.803, 0.025),
        (-0.339, -0.588, 0.025),
        (0.155, -0.731, 0.025),
        (0.211, -0.633, 0.025),
    ),
    lift_cup_sizes=((0.3, 0.6), (0.3, 0.9), (0.5, 0.8), (0.9, 0.6)),
    trials=5,
    max_steps=100,
    grid_shape=(3, 4),
    grid_extent=(0.12, 0.856),
    near_miss=0.05,
    fetch_cube_distance=0.5,
    lift_cup_height=0.4,
    own_successes={"fetch_cube": (5, 5, 5, 5), "lift_cup": (5, 5, 5, 5)},
    grid_successes=(10, 4, 6, 5),
)
