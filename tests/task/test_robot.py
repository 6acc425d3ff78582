"""What deployment asks of a task: an account of the arm, trials, and a handle where tools lack one."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task.robot import ArmReport, DeployedSimulator, DeploymentSpec, RobotTrials


def test_the_mean_tracking_error_is_that_of_the_steps_counted() -> None:
    assert ArmReport().tracking_error_mean == 0.0
    assert ArmReport(tracking_error_sum=0.06, tracking_error_max=0.03, steps=4).tracking_error_mean == pytest.approx(
        0.015
    )


def test_tools_have_their_own_handle_unless_told() -> None:
    trials = RobotTrials(np.zeros((1, 2)), np.zeros((0, 0, 2)), 0.0, 0.0, trials_per_tool=1, max_steps=1)

    def nothing_to_try(num_slots: int, arm: str) -> DeployedSimulator:
        raise NotImplementedError

    assert DeploymentSpec(trials, nothing_to_try).gripper_handle() == ()
