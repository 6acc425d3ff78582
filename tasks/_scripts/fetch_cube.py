"""A hand-written designer and controller for fetch cube.

Shapes: `B` batch (may be absent), `O` observation, `D` = 11 design, `C` = 3 control, `K` = 3 links, `P` places beside
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
"""Kinds of paths: straight there, first along x, first along y, or first back towards the robot."""


class FetchCubeScript(Behaviour):
    """Brings a side of a link behind the cube as seen from the base, then pulls towards the base.

    Every link has a few places on both of its sides. The one is taken that lets the cube go furthest before the held
    point leaves its box, is near, and can be reached around the cube: straight, first sideways or first along y. The
    choice is made anew in every step, so that a place further down the link follows when a pull has come to its end.
    """

    LINK_WIDTH, LINK_HEIGHT = 0.02, 0.03
    """Of every link of its tools, m."""
    HOOK, BENT, BAR = (0.0, -90.0), (-45.0, -45.0), (-65.0, 0.0)
    """Angles of its tools, degrees: for cubes in the middle, at the side, and far away. Left ones get mirror images."""
    HOOK_BEHIND = 0.045
    """The hook starts so far behind the cube's centre if the links are long enough for that, m."""
    FAR, ASIDE = 0.7, 0.22
    """Cubes at larger y are far ones, cubes at larger abs(x) lie at the side, m."""

    PLACES_PER_LINK = 4
    CONSIDERED = 8
    """The ways to this many places are looked at."""
    WAY_POINTS = 8
    """Points on each way."""
    GAP = 0.004
    """Between link and cube until a pull begins, m."""
    DISC = 0.027
    """On its way a link keeps this far from the cube's centre, m."""
    FACING = 0.75
    """Smallest cosine between a link's side and the pull, within the friction's cone."""
    GAIN_WEIGHT, MISS_WEIGHT = 10.0, 20.0
    """What a metre of pull is worth, and what a metre beyond the held point's box costs, in metres of way."""
    DETOURS = (0.0, 0.05, 0.05, 0.1)
    """What each kind of path costs, in metres of way."""
    INSIDE = 0.03
    """The cube is pulled this far beyond the goal's edge, m."""

    def __init__(self, task: FetchCube) -> None:
        self.task = task

    def design(self, observation: Singles) -> Singles:
        """Return a hook, a bent chain or a bar by the cube's place."""
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
        """Return the links' lengths (B, K), m: the two before a hook's bend reach just behind a cube (B, 2)."""
        short, long = SIZES[SIZE_NAMES.index("length")]
        reach = 0.5 * (cube[:, 1] + self.HOOK_BEHIND - HOLD_START[1])
        lengths = np.full((len(cube), NUM_LINKS), long)
        lengths[:, 0] = np.where(far, long, np.where(aside, short, np.clip(reach, short, long)))
        lengths[:, 1] = np.where(far, long, lengths[:, 0])
        return lengths

    def act(self, observation: Singles) -> Singles:
        """Return the held point's move, normalised."""
        seen = self.task.layout.split(np.atleast_2d(observation).astype(np.float64))
        cube, hold = seen.state[:, CUBE], seen.state[:, HOLD_IN_PLANE]
        pull = -cube / np.linalg.norm(cube, axis=1, keepdims=True)
        # What is observed is four times the cube's turn, since a cube looks the same after a quarter turn.
        turn = 0.25 * np.arctan2(seen.state[:, TURN_SIN], seen.state[:, TURN_COS])
        _, boxes = chain_boxes(DESIGN.from_unit(seen.design))
        ways, score = self._ways(cube, hold, pull, turn, boxes)
        way, leg = self._choose(cube - hold, ways, score, HOLD_Y[0] - hold[:, 1], boxes)
        there = np.linalg.norm(way, axis=1, keepdims=True) < 3.0 * self.GAP
        # Close by, the link pulls at full speed while it still closes what is left of its way.
        move = np.where(there, 0.5 * way / STEP_LENGTH + pull, leg / STEP_LENGTH)
        controls = np.zeros((len(cube), self.task.control_space.size), dtype=np.float32)
        controls[:, IN_PLANE] = move / np.maximum(1.0, np.linalg.norm(move, axis=1, keepdims=True))
        return controls if observation.ndim == 2 else controls[0]

    def _choose(self, cube: Floats, ways: Floats, score: Floats, back: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return the best way (B, 2) and the next leg (B, 2) of its path around the cube, m.

        Args:
            cube: the cubes' centres (B, 2), from the held point, m.
            ways: to the considered places (B, P, 2), m.
            score: how good the places are (B, P), in metres of way.
            back: how far along y the held points may go back (B,), m, negative.
            boxes: of the tools.
        """
        paths = _paths(ways, back, self.WAY_POINTS)
        # The tool is moved without being turned, so instead of the tool the cube is moved, the other way.
        gaps = _gaps(cube[:, None, None, None] - paths, boxes)
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
        """Return the held point's ways (B, P, 2) to the best places for a pull, and how good these are, (B, P)."""
        places, sides = self._places(turn, boxes)
        held = cube[:, None] - places
        low, high = np.array([HOLD_X[0], HOLD_Y[0]]), np.array([HOLD_X[1], HOLD_Y[1]])
        # How far the held point can go along the pull before it leaves its box; infinitely far along a zero entry.
        with np.errstate(divide="ignore"):
            room = np.where(pull[:, None] > 0.0, high - held, low - held) / pull[:, None]
        needed = np.linalg.norm(cube, axis=1, keepdims=True) - GOAL_DISTANCE + self.INSIDE
        # A link whose side looks away from the pull by more than friction holds lets the cube slip off.
        facing = (sides * pull[:, None]).sum(axis=2)
        gain = np.clip(np.minimum(room.min(axis=2), needed), 0.0, None) * facing * (facing > self.FACING)
        ways = held - hold[:, None]
        missed = np.linalg.norm(np.clip(held, low, high) - held, axis=2)
        score = self.GAIN_WEIGHT * gain - np.linalg.norm(ways, axis=2) - self.MISS_WEIGHT * missed
        best = np.argsort(-score, axis=1)[:, : self.CONSIDERED]
        return np.take_along_axis(ways, best[..., None], axis=1), np.take_along_axis(score, best, axis=1)

    def _places(self, turn: Floats, boxes: Boxes) -> tuple[Floats, Floats]:
        """Return where the cube's centre may lie beside links, from the held point, and the links' sides (B, P, 2)."""
        heading = link_turns(boxes)
        normal = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
        share = (2.0 * np.arange(self.PLACES_PER_LINK) + 1.0) / self.PLACES_PER_LINK - 1.0
        middle = boxes.centres[:, :, None, XY] + (boxes.half_extents[..., 1:2] * share)[..., None] * along[:, :, None]
        # A square turned by `skew` reaches half its side times abs(cos) + abs(sin) towards the link.
        skew = heading - turn[:, None]
        reach = boxes.half_extents[..., 0] + 0.5 * CUBE_SIZE * (np.abs(np.cos(skew)) + np.abs(np.sin(skew))) + self.GAP
        away = (normal * reach[..., None])[:, :, None]
        shape = (len(turn), -1, 2)
        sides = np.repeat(normal, self.PLACES_PER_LINK, axis=1)
        places = np.concatenate([(middle + away).reshape(shape), (middle - away).reshape(shape)], axis=1)
        return places, np.concatenate([sides, -sides], axis=1)


def _paths(ways: Floats, back: Floats, count: int) -> Floats:
    """Return (B, P, 4, T = count, 2) points on the four kinds of paths along `ways` (B, P, 2), after equal times, m.

    A path that begins with going back first moves by `back` (B,) along y.
    """
    share = (np.arange(count) + 1.0) / count
    # Along one axis in the first half of the time, along the other in the second.
    early, late = np.clip(2.0 * share, 0.0, 1.0), np.clip(2.0 * share - 1.0, 0.0, 1.0)
    # Going back, moving along x and coming forward overlap, so the corners of that path are rounded off.
    aside = np.clip(1.5 * share - 0.25, 0.0, 1.0)
    shares = np.stack([[share, share], [early, late], [late, early], [aside, late]])
    paths: Floats = ways[:, :, None, None] * shares.transpose(0, 2, 1)
    paths[:, :, BACK_FIRST, :, 1] += back[:, None, None] * np.minimum(4.0 * share, np.minimum(1.0, 2.0 - 2.0 * share))
    return paths


def _gaps(points: Floats, boxes: Boxes) -> Floats:
    """Return how far `points` (B, ..., 2), seen from the held point, are from the nearest link, m; negative inside."""
    heading, nearest = link_turns(boxes), np.full(points.shape[:-1], np.inf)
    widen = (slice(None),) + (None,) * (points.ndim - 2)
    for link in range(NUM_LINKS):
        offset = points - boxes.centres[:, link, XY][widen]
        cos, sin = np.cos(heading[:, link])[widen], np.sin(heading[:, link])[widen]
        half = boxes.half_extents[:, link]
        # Distances from the faces of a box, in its own axes: both positive beyond a corner, both negative inside.
        across = np.abs(cos * offset[..., 0] + sin * offset[..., 1]) - half[:, 0][widen]
        along = np.abs(cos * offset[..., 1] - sin * offset[..., 0]) - half[:, 1][widen]
        outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
        nearest = np.minimum(nearest, outside + np.minimum(np.maximum(across, along), 0.0))
    return nearest
