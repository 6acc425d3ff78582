"""What claims are judged on: frames of finished cells alone, and in words what is lacking."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from builders import store_table
from codesign_bench.cell.variant import Variant
from codesign_bench.claims.evidence import Evidence, load_evidence
from codesign_bench.claims.finding import InsufficientData
from codesign_bench.cli import main
from codesign_bench.errors import UserError
from codesign_bench.storage.measurements import REFERENCE_POINTS
from codesign_bench.storage.records import FAILED, RUNNING
from codesign_bench.task import load_task
from evidence import OTHER, OURS, TASK, curves, finals, make_cell, make_results


@pytest.mark.parametrize("content", ["somebody,else\n1,2\n", 'a,b\n1,2,3\n"', ""])
def test_a_damaged_cell_is_left_out_and_named_and_the_others_are_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str
) -> None:
    make_results(tmp_path)
    (tmp_path / "push" / "gnn_ppo" / "default" / "seed-01" / "evaluation.csv").write_text(content)
    assert main(["verify", "--results", str(tmp_path), "--out", str(tmp_path / "claims")]) == 0
    told = "push/gnn_ppo/default/seed-01/evaluation.csv: its checksum does not match"
    assert capsys.readouterr().err == f"left out: {told}\n"
    assert json.loads((tmp_path / "claims" / "claims.json").read_text())["left_out"] == [told]
    assert f"- {told}\n" in (tmp_path / "claims" / "claims.md").read_text()
    assert load_evidence(tmp_path).evaluations["seed"].value_counts().to_dict() == {0: 4, 1: 2, 2: 4}


def test_unfinished_and_failed_cells_do_not_count(tmp_path: Path) -> None:
    make_results(tmp_path)
    make_cell(tmp_path, "gnn_ppo", 3, 99.0, status=FAILED)
    make_cell(tmp_path, "gnn_ppo", 4, 99.0, status=RUNNING)
    assert load_evidence(tmp_path).final_returns("push", "gnn_ppo").tolist() == [2.0, 2.1, 2.2]


def test_reference_points_are_read_where_there_are_any(tmp_path: Path) -> None:
    make_results(tmp_path)
    assert load_evidence(tmp_path).references.empty
    row = {"task": "push", "task_version": 1, "point": "idle", "return_mean": -1.5, "success_rate": 0.0}
    store_table(tmp_path / "reference_points.csv", REFERENCE_POINTS, row)
    assert load_evidence(tmp_path).references[list(row)].to_dict("records") == [row]


def test_reference_points_of_another_version_of_the_task_are_left_out(tmp_path: Path) -> None:
    make_results(tmp_path)
    store_table(tmp_path / "reference_points.csv", REFERENCE_POINTS, {"task": "push", "task_version": 2})
    assert load_evidence(tmp_path).references.empty


def test_final_returns_are_one_mean_per_seed_over_its_instances() -> None:
    evaluations = pd.concat([finals(OURS, (1.0, 2.0, 3.0)), finals(OURS, (3.0, 2.0, 4.0)), finals(OTHER, (9.0,) * 3)])
    evidence = Evidence(evaluations=evaluations)
    assert evidence.final_returns(TASK, OURS).tolist() == [2.0, 2.0, 3.5]
    assert len(evidence.instances(TASK, OURS)) == 6


def test_a_method_counts_in_its_own_task_and_variant() -> None:
    varied = Variant.of(alpha=0.3)
    parts = [finals(OURS, (1.0,) * 3), finals(OURS, (2.0,) * 3, varied.name), finals(OURS, (3.0,) * 3, task="scoop")]
    evidence = Evidence(evaluations=pd.concat(parts))
    assert evidence.final_returns(TASK, OURS).mean() == 1.0
    assert evidence.final_returns(TASK, OURS, varied).mean() == 2.0
    assert evidence.final_returns("scoop", OURS).mean() == 3.0


@pytest.mark.parametrize(
    ("seeds", "counted"), [(0, "0 finished seeds"), (1, "1 finished seed"), (2, "2 finished seeds")]
)
def test_fewer_than_three_seeds_say_nothing(seeds: int, counted: str) -> None:
    evidence = Evidence(evaluations=finals(OURS, (1.0,) * seeds)) if seeds else Evidence()
    with pytest.raises(InsufficientData, match=f"{counted} of push/gnn_ppo/default; 3 are needed"):
        evidence.final_returns(TASK, OURS)


def test_a_budget_is_the_mean_over_finished_seeds_of_the_steps_at_their_ends() -> None:
    frame = curves(OURS, [(0.0, 1.0)] * 4, steps=(0, 100))
    frame.loc[(frame["seed"] == 0) & (frame["env_steps"] == 100), "env_steps"] = 130
    frame.loc[(frame["seed"] == 3) & (frame["env_steps"] == 100), "env_steps"] = 9_000  # still running
    evidence = Evidence(curves=frame, evaluations=finals(OURS, (1.0,) * 3))
    assert evidence.budget(TASK, OURS) == pytest.approx(110.0)
    assert set(evidence.curve(TASK, OURS)["seed"]) == {0, 1, 2}


def test_a_finished_cell_without_its_curve_is_lacking() -> None:
    evidence = Evidence(curves=curves(OURS, [(0.0, 1.0, 2.0)] * 2), evaluations=finals(OURS, (1.0,) * 3))
    with pytest.raises(InsufficientData, match="a finished cell of push/gnn_ppo/default has no curve"):
        evidence.curve(TASK, OURS)


def test_a_task_is_known_if_any_frame_speaks_of_it() -> None:
    evidence = Evidence(evaluations=finals(OURS, (1.0,)), sensitivity=pd.DataFrame({"task": ["scoop", "scoop"]}))
    assert evidence.tasks == {"push", "scoop"}
    assert Evidence().tasks == set()


def test_what_lies_in_a_results_folder_is_read_as_it_is(tmp_path: Path) -> None:
    make_results(tmp_path)
    evidence = load_evidence(tmp_path)
    assert evidence.final_returns(TASK, OTHER).tolist() == [1.0, 1.0, 1.0]
    assert evidence.budget(TASK, OURS) == 100.0
    assert evidence.profile == "quick"
    assert (len(evidence.sensitivity), len(evidence.outside), len(evidence.deployment)) == (0, 0, 0)
    low, high = load_task(TASK).design_space.bounds
    assert list(evidence.design_widths[TASK].values()) == pytest.approx((high - low).tolist())
    assert "design_link_1_length" in evidence.design_widths[TASK]


def test_cells_of_several_profiles_are_asked_for_with_the_default_one(tmp_path: Path) -> None:
    make_results(tmp_path)
    path = make_cell(tmp_path, OURS, 9, 1.0) / "cell.json"
    path.write_text(path.read_text().replace('"quick"', '"paper"'))
    assert load_evidence(tmp_path).profile == "laptop"


def test_a_folder_in_which_nothing_is_finished_is_answered_with_the_command_that_makes_results(tmp_path: Path) -> None:
    make_cell(tmp_path, OURS, 0, 1.0, status=RUNNING)
    with pytest.raises(UserError, match="create some with: codesign-bench run --method"):
        load_evidence(tmp_path)
