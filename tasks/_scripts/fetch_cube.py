"""A hand-written designer and controller for fetch cube.

Shapes: `B` batch (may be absent), `O` observation, `D` = 11 design, `C` = 3 control, `K` = 3 links, `P` places at
links, `T` points on a path.
"""

from __future__ import annotations

import numpy as np

from codesign_bench.task import Behaviour, Booleans, Floats, Singles

from .._bullet import Boxes
from ..fetch_cube import (
    CUBE,
    CUBE_SIZE,
    DESIGN,
    GOAL_DISTANCE,
    HOLD_IN_PLANE,
    HOLD_START,
    HOLD_X,
    HOLD_Y,
    IN_PLANE,
    JOINT_ANGLES,
    LINK_SIZES,
    NUM_LINKS,
    SIZE_NAMES,
    SIZES,
    STEP_LENGTH,
    TURN_COS,
    TURN_SIN,
    XY,
    FetchCube,
    chain_boxes,
    link_turns,
)

STRAIGHT, X_FIRST, Y_FIRST, BACK_FIRST = range(4)
"""Kinds of paths: straight, first along x, first along y, or first back towards the robot."""


class FetchCubeScript(Behaviour):
    """Moves a side of a link behind the cube as seen from the base, then pulls towards the base.

    Every link has a few candidate places for the cube on both sides. The chosen place lets the cube be pulled far
    before the held point leaves its box, is near, and can be reached around the cube by one of four kinds of paths. The
    choice is repeated in every step, so that another place along the link follows when a pull is at its end.
    """

    LINK_WIDTH, LINK_HEIGHT = 0.02, 0.03
    """Of every link of the script's tools, m."""
    HOOK, BENT, BAR = (0.0, -90.0), (-45.0, -45.0), (-65.0, 0.0)
    """Joint angles of the tools, degrees, for cubes in the middle, at the side, and far away; mirrored on the left."""
    HOOK_BEHIND = 0.045
    """Distance from the cube's centre to the hook behind it at the start, m, if the links are long enough."""
    FAR, ASIDE = 0.7, 0.22
    """Cubes at larger y are far away, cubes at larger abs(x) are at the side, m."""

    PLACES_PER_LINK = 4
    CONSIDERED = 8
    """Number of best places for which paths are checked."""
    WAY_POINTS = 8
    """Points on each path."""
    GAP = 0.004
    """Gap between link and cube until a pull begins, m."""
    DISC = 0.027
    """Distance that links keep from the cube's centre on a path, m."""
    FACING = 0.75
    """Smallest cosine between a link's normal and the pull, within the friction cone."""
    GAIN_WEIGHT, MISS_WEIGHT = 10.0, 20.0
    """Gain of a metre of pull, and cost of a metre outside of the held point's box, in metres of way."""
    DETOURS = (0.0, 0.05, 0.05, 0.1)
    """Cost of each kind of path, in metres of way."""
    INSIDE = 0.03
    """The cube is pulled this far beyond the goal's edge, m."""

    def __init__(self, task: FetchCube) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return a hook, a bent chain or a bar, depending on the cube's position."""
        cube = self.task.layout.split(np.atleast_2d(observation)).state[:, CUBE].astype(np.float64)
        far, aside = cube[:, 1] > self.FAR, np.abs(cube[:, 0]) > self.ASIDE
        sizes = np.zeros((len(cube), NUM_LINKS, len(SIZE_NAMES)))
        sizes[..., SIZE_NAMES.index("width")] = self.LINK_WIDTH
        sizes[..., SIZE_NAMES.index("length")] = self._lengths(cube, far, aside)
        sizes[..., SIZE_NAMES.index("height")] = self.LINK_HEIGHT
        angles = np.deg2rad([self.HOOK, self.BENT, self.BAR])[np.where(far, 2, np.where(aside, 1, 0))]
        designs = np.zeros((len(cube), DESIGN.size))
        designs[:, LINK_SIZES] = sizes.reshape(len(cube), -1)
        designs[:, JOINT_ANGLES] = np.where(cube[:, :1] < 0.0, -angles, angles)
        result: Singles = DESIGN.to_unit(designs).astype(np.float32)
        return result if observation.ndim == 2 else result[0]

    def _lengths(self, cube: Floats, far: Booleans, aside: Booleans) -> Floats:
        """Return the links' lengths (B, K), m: the two before a hook's bend reach just behind the cube (B, 2)."""
        short, long = SIZES[SIZE_NAMES.index("length")]
        reach = 0.5 * (cube[:, 1] + self.HOOK_BEHIND - HOLD_START[1])
        lengths = np.full((len(cube), NUM_LINKS), long)
        lengths[:, 0] = np.where(far, long, np.where(aside, short, np.clip(reach, short, long)))
        lengths[:, 1] = np.where(far, long, lengths[:, 0])
        return lengths

    def act(self, observation: Singles) -> Singles:
        """Return the displacement of the held point, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        cube, hold = seen.state[:, CUBE], seen.state[:, HOLD_IN_PLANE]
        pull = -cube / np.linalg.norm(cube, axis=1, keepdims=True)
        # The observation has sine and cosine of four times the cube's angle, because a cube looks the same after a
        # quarter turn. So the angle is known up to quarter turns, which is all that matters here.
        turn = 0.25 * np.arctan2(seen.state[:, TURN_SIN], seen.state[:, TURN_COS])
        _, boxes = chain_boxes(DESIGN.from_unit(seen.design))
        ways, score = self._ways(cube, hold, pull, turn, boxes)
        way, leg = self._choose(cube - hold, ways, score, HOLD_Y[0] - hold[:, 1], boxes)
        there = np.linalg.norm(way, axis=1, keepdims=True) < 3.0 * self.GAP
        # Near its place, the link pulls at full speed and closes the remaining distance at the same time.
        move = np.where(there, 0.5 * way / STEP_LENGTH + pull, leg / STEP_LENGTH)
        controls = np.zeros((len(cube), self.task.control_space.size), dtype=np.float32)
        controls[:, IN_PLANE] = move / np.maximum(1.0, np.linalg.norm(move, axis=1, keepdims=True))
        return controls if observation.ndim == 2 else controls[0]

    def _choose(self, cube: Floats, ways: Floats, score: Floats, back: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return the best way (B, 2) and the next leg (B, 2) of its path around the cube, m.

        Args:
            cube: the cubes' centres (B, 2), relative to the held point, m.
            ways: displacements to the considered places (B, P, 2), m.
            score: scores of the places (B, P), in metres of way.
            back: how far the held points can move back along y (B,), m, negative.
            boxes: boxes of the tools.
        """
        paths = _paths(ways, back, self.WAY_POINTS)
        # The tool translates without rotation. In its frame the cube moves by the opposite displacement, so one point
        # per path point is checked against fixed boxes, instead of moving all boxes.
        gaps = _gaps(cube[:, None, None, None] - paths, boxes)
        # From 0 (the cube's disc is clear) to 1 (a link reaches the cube's centre), of the worst point on the path. It
        # is a cost, not an exclusion: if every path is blocked, the least bad one is taken.
        blocked = np.clip(1.0 - gaps / self.DISC, 0, 1).max(axis=3)
        total = (score[:, :, None] - blocked - self.DETOURS).reshape(len(cube), -1)
        place, kind = np.divmod(total.argmax(axis=1), len(self.DETOURS))
        way = ways[np.arange(len(cube)), place]
        leg = way.copy()
        leg[(kind == X_FIRST) & (np.abs(way[:, 0]) > self.GAP), 1] = 0.0
        leg[(kind == Y_FIRST) & (np.abs(way[:, 1]) > self.GAP), 0] = 0.0
        leg[kind == BACK_FIRST] = (0.0, -1.0)
        return way, leg

    def _ways(self, cube: Floats, hold: Floats, pull: Floats, turn: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return the held point's displacements (B, P, 2) to the best places for a pull, and their scores (B, P)."""
        places, sides = self._places(turn, boxes)
        held = cube[:, None] - places
        low, high = np.array([HOLD_X[0], HOLD_Y[0]]), np.array([HOLD_X[1], HOLD_Y[1]])
        # Distance that the held point can move along the pull before it leaves its box, per axis: infinite along an
        # axis on which the pull is zero.
        with np.errstate(divide="ignore"):
            room = np.where(pull[:, None] > 0.0, high - held, low - held) / pull[:, None]
        needed = np.linalg.norm(cube, axis=1, keepdims=True) - GOAL_DISTANCE + self.INSIDE
        # If the link's normal is further from the pull than the friction angle, the cube slips off the link.
        facing = (sides * pull[:, None]).sum(axis=2)
        # The gain is limited to the pull that is still needed: more room has no value, and nearness decides.
        gain = np.clip(np.minimum(room.min(axis=2), needed), 0.0, None) * facing * (facing > self.FACING)
        ways = held - hold[:, None]
        missed = np.linalg.norm(np.clip(held, low, high) - held, axis=2)
        score = self.GAIN_WEIGHT * gain - np.linalg.norm(ways, axis=2) - self.MISS_WEIGHT * missed
        best = np.argsort(-score, axis=1)[:, : self.CONSIDERED]
        return np.take_along_axis(ways, best[..., None], axis=1), np.take_along_axis(score, best, axis=1)

    def _places(self, turn: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return places of the cube's centre, relative to the held point, and the links' normals: (B, P, 2) each."""
        heading = link_turns(boxes)
        normal = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
        share = (2.0 * np.arange(self.PLACES_PER_LINK) + 1.0) / self.PLACES_PER_LINK - 1.0
        middle = boxes.centres[:, :, None, XY] + (boxes.half_extents[..., 1:2] * share)[..., None] * along[:, :, None]
        # Support of a square with side s in a direction at angle `skew` to its own: s / 2 (abs(cos) + abs(sin)). The
        # cube's centre is this far from the face that it touches, plus half the link's width.
        skew = heading - turn[:, None]
        reach = boxes.half_extents[..., 0] + 0.5 * CUBE_SIZE * (np.abs(np.cos(skew)) + np.abs(np.sin(skew))) + self.GAP
        away = (normal * reach[..., None])[:, :, None]
        shape = (len(turn), -1, 2)
        sides = np.repeat(normal, self.PLACES_PER_LINK, axis=1)
        places = np.concatenate([(middle + away).reshape(shape), (middle - away).reshape(shape)], axis=1)
        return places, np.concatenate([sides, -sides], axis=1)


def _paths(ways: Floats, back: Floats, count: int) -> Floats:
    """Return (B, P, 4, T = count, 2) points at equal time steps on the four kinds of paths along `ways` (B, P, 2), m.

    A path that starts back first moves by `back` (B,) along y.
    """
    share = (np.arange(count) + 1.0) / count
    # Along one axis in the first half of the time, along the other in the second half.
    early, late = np.clip(2.0 * share, 0.0, 1.0), np.clip(2.0 * share - 1.0, 0.0, 1.0)
    # The three phases, back, along x and forward, overlap in time, so that the corners of this path are rounded.
    aside = np.clip(1.5 * share - 0.25, 0.0, 1.0)
    shares = np.stack([[share, share], [early, late], [late, early], [aside, late]])
    paths: Floats = ways[:, :, None, None] * shares.transpose(0, 2, 1)
    # Back in the first quarter of the time, there until the half, forward again until the end.
    paths[:, :, BACK_FIRST, :, 1] += back[:, None, None] * np.minimum(4.0 * share, np.minimum(1.0, 2.0 - 2.0 * share))
    return paths


def _gaps(points: Floats, boxes: Boxes) -> Floats:
    """Return the signed distance of `points` (B, ..., 2), relative to the held point, to the nearest link, m."""
    heading, nearest = link_turns(boxes), np.full(points.shape[:-1], np.inf)
    widen = (slice(None),) + (None,) * (points.ndim - 2)
    for link in range(NUM_LINKS):
        offset = points - boxes.centres[:, link, XY][widen]
        cos, sin = np.cos(heading[:, link])[widen], np.sin(heading[:, link])[widen]
        half = boxes.half_extents[:, link]
        # Signed distance to a rectangle, in its own axes. Both components are positive beyond a corner, where the
        # distance is to the corner; both are negative inside, where the larger one is the distance to the nearest face.
        across = np.abs(cos * offset[..., 0] + sin * offset[..., 1]) - half[:, 0][widen]
        along = np.abs(cos * offset[..., 1] - sin * offset[..., 0]) - half[:, 1][widen]
        outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
        nearest = np.minimum(nearest, outside + np.minimum(np.maximum(across, along), 0.0))
    return nearest
