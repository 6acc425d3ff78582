"""Tables of trials: how a trial went, by hand, and where tables are missing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from builders import store_table
from codesign_bench import load_task
from codesign_bench.deployment.conditions import Physics
from codesign_bench.deployment.rollout import Rollout
from codesign_bench.deployment.tables import load_deployment, protocol_file, row, summarise
from codesign_bench.errors import UserError
from codesign_bench.storage.measurements import DEPLOYMENT
from codesign_bench.task import deployment_of
from codesign_bench.task.robot import ArmReport

NEAR_START = np.array([-0.211, 0.633])
"""Of tool 4, in the task's frame: the script fetches it."""


def test_a_cube_that_ends_within_5_cm_is_nearly_fetched() -> None:
    task = load_task("fetch_cube")
    rollout = Rollout(False, False, 0.0, 20, Physics(1.0, 1.0), ArmReport())
    settings = deployment_of(task).trials
    ends = [replace(rollout, success=outcome < 0.5, outcome=outcome) for outcome in (0.49, 0.54, 0.56)]
    rows = [row(task, settings, NEAR_START, end, kind="own", tool=1) for end in ends]
    assert [(entry["success"], entry["near"]) for entry in rows] == [(1, 0), (0, 1), (0, 0)]
    (summary,) = summarise(rows)
    assert (summary["trials"], summary["successes"], summary["near"]) == (3, 1, 1)


def test_without_trials_the_user_is_told_how_to_make_them(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="codesign-bench deploy --policy CELL --protocol"):
        load_deployment(tmp_path)


def test_each_policy_has_a_table_and_trials_of_the_first_version_are_of_seed_zero(tmp_path: Path) -> None:
    folder = tmp_path / "deployment" / "fetch_cube"
    assert [protocol_file(seed) for seed in (0, 3)] == ["protocol.csv", "protocol-seed-03.csv"]
    store_table(folder / protocol_file(0), DEPLOYMENT, {"task": "fetch_cube", "success": 1})
    assert load_deployment(tmp_path)["policy_seed"].tolist() == [0]
    later = {"task": "fetch_cube", "success": 0, "policy_seed": 3, "solved_in_training": 1}
    store_table(folder / protocol_file(3), DEPLOYMENT, later)
    trials = load_deployment(tmp_path).set_index("policy_seed")
    assert trials["success"].to_dict() == {0: 1, 3: 0}
    assert np.isnan(trials.loc[0, "solved_in_training"])
