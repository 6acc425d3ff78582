"""Forward and inverse kinematics of the Franka Panda's hand, without a simulator.

Shapes: `J` = 7 joints. Lengths are in m, angles in rad; a frame is a (4, 4) matrix that maps its own coordinates to the
base's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codesign_bench.task import Booleans, Floats

JOINT_PLACES = np.array(
    [
        (0.0, 0.0, 0.333, 0.0),
        (0.0, 0.0, 0.0, -0.5 * np.pi),
        (0.0, -0.316, 0.0, 0.5 * np.pi),
        (0.0825, 0.0, 0.0, 0.5 * np.pi),
        (-0.0825, 0.384, 0.0, -0.5 * np.pi),
        (0.0, 0.0, 0.0, 0.5 * np.pi),
        (0.088, 0.0, 0.0, 0.5 * np.pi),
    ]
)
"""(J, 4): position of each joint in the previous link's frame, m, and rotation about its x axis, rad (URDF)."""
HAND_PLACE, HAND_TURN = 0.107, -0.25 * np.pi
"""The hand's frame in the last link's frame: offset along z, m, and rotation about z, rad (URDF)."""
LOWEST = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
HIGHEST = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
"""Joint limits, rad (Franka's data sheet; the URDF's soft limits)."""
FASTEST = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
"""Joint speed limits, rad/s (data sheet and URDF)."""
STRONGEST = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])
"""Joint torque limits, N m (data sheet and URDF)."""
READY = np.array([0.0, -0.25 * np.pi, 0.0, -0.75 * np.pi, 0.0, 0.5 * np.pi, 0.25 * np.pi])
"""Franka's posture of rest, rad."""

LIMIT_MARGIN = 0.01
"""Postures stay this far inside the joints' limits, rad (ours)."""
PLACE_TOLERANCE, TURN_TOLERANCE = 1e-4, 1e-3
"""A frame counts as reached within these errors, m and rad (ours)."""
MOST_ITERATIONS = 40
LEAST_DAMPING = 1e-6
"""Smallest damping of the least squares; the squared error is added, so that only steps far from the target are short
(ours)."""
LONGEST_STEP = 0.3
"""Largest step of a joint in one iteration, rad (ours)."""
REST_PULL = 0.02
"""Fraction of the way to the posture of rest that the redundant joint moves in each iteration (ours)."""


@dataclass(frozen=True)
class Posture:
    """Joint angles for a wanted frame of the hand."""

    angles: Floats
    """(J,) rad."""
    place_error: float
    """Distance between the hand's frame and the wanted one, m."""
    turn_error: float
    """Angle between the two frames, rad."""
    at_limit: Booleans
    """(J,) which joints are at their limits."""

    @property
    def reached(self) -> bool:
        """Whether the hand is at the wanted frame, within tolerance."""
        return self.place_error < PLACE_TOLERANCE and self.turn_error < TURN_TOLERANCE


def hand_frame(angles: Floats) -> Floats:
    """Return the frame of the hand (4, 4) for joint angles (J,)."""
    return joint_frames(angles)[-1]


def joint_frames(angles: Floats) -> list[Floats]:
    """Return the frames of the seven joints, rotated by their angles (J,), and of the hand."""
    frames, frame = [], np.eye(4)
    for (x, y, z, turn), angle in zip(JOINT_PLACES.tolist(), angles.tolist(), strict=True):
        frame = frame @ _place_and_turns(x, y, z, turn, angle)
        frames.append(frame)
    return [*frames, frame @ _place_and_turns(0.0, 0.0, HAND_PLACE, 0.0, HAND_TURN)]


def jacobian(frames: list[Floats]) -> Floats:
    """Return (6, J): velocity (3) and angular velocity (3) of the hand per joint speed, from `joint_frames`."""
    result = np.empty((6, len(LOWEST)))
    tip = frames[-1][:3, 3]
    for joint, frame in enumerate(frames[:-1]):
        # A joint turns about its frame's z axis: the hand turns with it, and moves across the lever from joint to hand.
        axis = frame[:3, 2]
        result[:3, joint] = np.cross(axis, tip - frame[:3, 3])
        result[3:, joint] = axis
    return result


def solve(wanted: Floats, start: Floats, rest: Floats) -> Posture:
    """Return the posture near `start` (J,) whose hand is nearest to the frame `wanted` (4, 4).

    Least squares, damped by the squared error (Sugihara 2011), within the joint limits: a joint that would leave its
    range is held at the limit while the others move. The seventh degree of freedom drifts towards `rest` (J,). Started
    from the last posture, the solution does not jump to another branch.
    """
    low, high = LOWEST + LIMIT_MARGIN, HIGHEST - LIMIT_MARGIN
    angles = np.clip(start, low, high)
    for iteration in range(MOST_ITERATIONS + 1):
        frames = joint_frames(angles)
        error = _difference(wanted, frames[-1])
        place, turn = float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
        done = place < 0.5 * PLACE_TOLERANCE and turn < 0.5 * TURN_TOLERANCE
        # At least one iteration, even at the wanted frame: a held point that does not move still drifts to rest.
        if (done and iteration > 0) or iteration == MOST_ITERATIONS:
            break
        angles = np.clip(angles + _step(jacobian(frames), error, angles, rest, low, high), low, high)
    return Posture(angles, place, turn, (angles <= low + 1e-9) | (angles >= high - 1e-9))


def _step(slopes: Floats, error: Floats, angles: Floats, rest: Floats, low: Floats, high: Floats) -> Floats:
    """Return the change of the angles (J,) in one iteration; joints that would leave their range are held."""
    free = np.ones(len(angles), dtype=bool)
    step = np.zeros(len(angles))
    for _ in range(len(angles)):
        own = slopes[:, free]
        # The error damps the inverse: far away or out of reach, where the linear model is wrong or singular, steps are
        # short and stable; close by, the damping almost vanishes and convergence is fast.
        weights = own.T @ np.linalg.inv(own @ own.T + (LEAST_DAMPING + error @ error) * np.eye(6))
        pull = REST_PULL * (rest - angles)[free]
        step = np.zeros(len(angles))
        # The pull alone would move the hand. Subtracting its effect from the error leaves only its part in the null
        # space of the Jacobian: the elbow moves towards rest, the hand to its target.
        step[free] = weights @ (error - own @ pull) + pull
        step *= min(1.0, LONGEST_STEP / max(np.abs(step).max(), 1e-9))
        # A step that is merely clipped would lose this joint's part of the motion. Without its column, the others are
        # solved again to make up for it; holding one joint may push the next to its limit, hence the loop.
        leaving = free & (((angles >= high - 1e-9) & (step > 0.0)) | ((angles <= low + 1e-9) & (step < 0.0)))
        if not leaving.any():
            break
        free &= ~leaving
    return step


def _difference(wanted: Floats, frame: Floats) -> Floats:
    """Return (6,): the translation, m, and the rotation vector, rad, from a frame to the wanted one."""
    turn = wanted[:3, :3] @ frame[:3, :3].T
    axis = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine, cosine = float(np.linalg.norm(axis)), 0.5 * (float(np.trace(turn)) - 1.0)
    # From sine and cosine, since either one is inaccurate or ambiguous for some angles. Near zero,
    # where the axis has no direction, sine and angle are equal.
    angle = float(np.arctan2(sine, cosine))
    vector = axis * (angle / sine) if sine > 1e-9 else axis
    return np.concatenate([wanted[:3, 3] - frame[:3, 3], vector])


def _place_and_turns(x: float, y: float, z: float, about_x: float, about_z: float) -> Floats:
    (cx, sx), (cz, sz) = (np.cos(about_x), np.sin(about_x)), (np.cos(about_z), np.sin(about_z))
    return np.array([[cz, -sz, 0.0, x], [cx * sz, cx * cz, -sx, y], [sx * sz, sx * cz, cx, z], [0.0, 0.0, 0.0, 1.0]])
