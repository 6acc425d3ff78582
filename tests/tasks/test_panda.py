"""The simulated Panda: its kinematics are its model's, it goes where it is told, and what goes wrong is counted."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from codesign_bench import load_task
from codesign_bench.task import deployment_of
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.robot import IDEAL, PANDA, ArmReport

pytestmark = pytest.mark.numeric

kinematics: Any = import_module("codesign_bench.tasks._panda_kinematics")
panda: Any = import_module("codesign_bench.tasks._panda")
pybullet: Any = import_module("pybullet")

SLOT = np.array([0])
MIDDLE = np.array([[0.1, 0.65]])


def started(name: str = "fetch_cube", instance: np.ndarray = MIDDLE) -> Any:
    """Return episodes of a task on a Panda, right after the design step with the tool in the middle of its space."""
    task = load_task(name)
    episodes = Episodes(task, 1, simulator=deployment_of(task).make_simulator(1, PANDA))
    episodes.begin(SLOT, instance)
    episodes.design(SLOT, np.zeros((1, task.design_space.size)))
    return episodes


def report(episodes: Any) -> ArmReport:
    """Return what happened to the arm."""
    result: ArmReport = episodes.simulator.arm_report(0)
    return result


def test_our_kinematics_put_the_hand_where_the_model_does() -> None:
    episodes = started()
    held = episodes.simulator.held[0]
    rng = np.random.default_rng(0)
    for _ in range(5):
        angles = rng.uniform(kinematics.LOWEST, kinematics.HIGHEST)
        for joint, angle in enumerate(angles):
            pybullet.resetJointState(held.body, joint, angle, physicsClientId=held.world)
        frame = kinematics.hand_frame(angles) @ np.linalg.inv(panda.GRIP)
        in_world = np.array([-frame[1, 3], frame[0, 3], frame[2, 3]])  # the base stands at the origin, turned left
        assert held.read() == pytest.approx(in_world.tolist(), abs=1e-5)


@pytest.mark.parametrize("x", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("y", [0.3, 0.5])
def test_the_arm_reaches_the_whole_box_of_the_held_point_of_fetch_cube(x: float, y: float) -> None:
    arm = panda.PandaArm((0.0, 0.0, 0.0), None)
    for z in (0.006, 0.04):
        posture = arm.first_posture(np.array([x, y, z]))
        assert posture.reached
        assert not posture.at_limit.any()


def test_the_tool_goes_where_it_is_told_within_millimetres() -> None:
    episodes = started(instance=np.array([[0.39, 0.8]]))  # the cube lies out of the way
    for way in [(-1.0, 0.0, 0.0), (0.0, -1.0, 0.1), (0.0, 1.0, -0.1)]:
        for _ in range(6):
            episodes.control(SLOT, np.array([way]))
    assert episodes.simulator.pose[0] == pytest.approx([-0.12, 0.5, 0.02], abs=0.006)
    seen = report(episodes)
    assert 0.0 < seen.tracking_error_mean < 0.005
    assert (seen.unreachable_steps, seen.joint_limit_steps, seen.self_collision_steps) == (0, 0, 0)
    assert (seen.scene_contact_steps, seen.object_contact_steps) == (0, 0)


def test_out_of_reach_is_counted_and_the_arm_stays_whole() -> None:
    episodes = started("lift_cup", np.array([[0.5, 0.8]]))
    held = episodes.simulator.held[0]
    for _ in range(60):
        held.drive([0.0, 0.48, 0.48])
        held.advance(10)
    seen = report(episodes)
    assert seen.unreachable_steps > 5
    assert seen.tracking_error_max < 3.0 * panda.LEASH
    angles = np.array([pybullet.getJointState(held.body, joint, held.world)[0] for joint in range(7)])
    assert (angles > kinematics.LOWEST).all()
    assert (angles < kinematics.HIGHEST).all()


def test_an_arm_folded_into_itself_is_counted() -> None:
    folded = (0.0, 1.0, 0.0, -3.05, 0.0, 0.3, 0.78)
    for angles, expected in ((kinematics.READY.tolist(), 0), (folded, 1)):
        episodes = started()
        held = episodes.simulator.held[0]
        for joint, angle in enumerate(angles):
            pybullet.resetJointState(held.body, joint, angle, physicsClientId=held.world)
        held.advance(0)
        assert report(episodes).self_collision_steps == expected


def test_a_hand_that_touches_something_fixed_is_counted() -> None:
    episodes = started()
    held = episodes.simulator.held[0]
    slab = episodes.simulator.add_box(0, (0.2, 0.2, 0.05), (0.0, 0.45, 0.17))  # in the hand's way
    held._scene.append(slab)
    held.drive([0.0, 0.0, 0.0])
    held.advance(1)
    assert report(episodes).scene_contact_steps == 1


def test_the_gantry_reports_no_incident() -> None:
    task = load_task("fetch_cube")
    episodes = Episodes(task, 1, simulator=deployment_of(task).make_simulator(1, IDEAL))
    episodes.begin(SLOT, MIDDLE)
    episodes.design(SLOT, np.zeros((1, 11)))
    episodes.control(SLOT, np.zeros((1, 3)))
    assert report(episodes) == ArmReport()


def test_friction_and_mass_of_the_cube_change_and_nothing_else_of_it() -> None:
    episodes = started()
    simulator = episodes.simulator
    world, (cube,) = simulator.worlds[0], simulator.moving[0]
    before = pybullet.getDynamicsInfo(cube, -1, physicsClientId=world)
    simulator.perturb(0, friction=0.5, mass=2.0)
    after = pybullet.getDynamicsInfo(cube, -1, physicsClientId=world)
    assert after[0] == pytest.approx(2.0 * before[0])
    assert after[1] == pytest.approx(0.5 * before[1])
    assert after[2] == pytest.approx([2.0 * value for value in before[2]])
    assert after[3:] == before[3:]


def test_an_episode_on_the_arm_is_the_same_twice() -> None:
    ends = []
    for _ in range(2):
        episodes = started()
        rng = np.random.default_rng(3)
        for _ in range(15):
            episodes.control(SLOT, rng.uniform(-1.0, 1.0, (1, 3)))
        ends.append(episodes.observation.copy())
    assert (ends[0] == ends[1]).all()
