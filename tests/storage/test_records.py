"""The cell file: written and read in one place, in the present form and in that of version 0.1.0."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from builders import BUDGET, store_cell
from codesign_bench.cell.variant import Variant
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.errors import UserError
from codesign_bench.member_code import MemberCode
from codesign_bench.storage.records import DONE, FAILED, CellRecord, Failure, Timings

VERSION_0_1_0: dict[str, Any] = {
    "schema": 1,
    "status": "done",
    "task": "catch_balls",
    "method": "gnn_ppo",
    "seed": 3,
    "cutout": None,
    "alpha": 0.3,
    "profile": "laptop",
    "variant": "alpha-0.30",
    "label": "GNN-PPO",
    "env_steps": 1000,
    "config": {"run": {"steps": {"value": 900, "source": "ours"}}, "method": {}},
    "versions": {"python": "3.11.7", "pybullet": None},
    "host": {"name": "desk", "cpu": "some CPU", "threads": 2},
    "pid": 7,
    "timings": {
        "started": "2026-01-01T00:00:00+00:00",
        "ended": None,
        "train_s": 1.5,
        "evaluate_s": 2.0,
        "wall_s": 4.0,
    },
    "failure": {"message": "it broke", "traceback": "Traceback\nValueError: it broke"},
}


def test_a_record_is_read_as_it_was_written(tmp_path: Path) -> None:
    record = CellRecord(
        task="push",
        method="gnn_ppo",
        variant=Variant.of(cutout=0.4, finetune=2),
        seed=1,
        task_version=3,
        label="Ours",
        status=FAILED,
        env_steps=12,
        config=BUDGET,
        versions={"torch": "2.13.0", "pybullet": None},
        code={"version": "0.2.0", "commit": None, "changed": None, "fingerprint": "1f"},
        packages={"sticks": {"version": "1.0", "commit": None, "changed": None, "fingerprint": "2f"}},
        members={"task": MemberCode("sticks.reach", "sticks", {"sticks.reach": "3f"})},
        host={"threads": 3},
        earlier=({"code": {}, "versions": {}, "host": {"cpu": "some CPU"}},),
        pid=5,
        timings=Timings(started="2026-01-01T00:00:00+00:00", wall_s=2.5),
        failure=Failure("it broke", "Traceback"),
    )
    record.write(tmp_path)
    assert CellRecord.read(tmp_path) == record
    assert record.threads == 3


def test_a_folder_without_a_record_has_none(tmp_path: Path) -> None:
    assert CellRecord.read(tmp_path) is None


def test_a_record_of_version_0_1_0_is_read_with_the_axes_that_it_had() -> None:
    record = CellRecord.from_json(VERSION_0_1_0)
    assert record.variant == Variant.of(alpha=0.3)
    assert record.config == StoredConfig(run={"steps": Sourced(900, "ours")}, method={})
    assert (record.threads, record.timings.train_s, record.failure) == (
        2,
        1.5,
        Failure("it broke", "Traceback\nValueError: it broke"),
    )
    assert (record.code, record.earlier) == ({}, ())
    unknown: dict[str, Any] = {"code": {}, "packages": {}, "members": {}}
    assert record.conditions == {**unknown, "versions": VERSION_0_1_0["versions"], "host": VERSION_0_1_0["host"]}
    older = CellRecord.from_json({**VERSION_0_1_0, "finetune": 2, "alpha": None, "label": ""})
    assert older.variant == Variant.of(finetune=2)
    assert older.label == "gnn_ppo"


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        ({"status": "sleeping"}, "unknown status 'sleeping'"),
        ({"schema": True}, "unknown schema True"),
        ({"config": {"run": {}}}, "no 'method'"),
        ({"config": {"run": {}, "method": {}}}, "no 'steps'"),
        ({"config": None}, "'config' is not an object"),
        ({"env_steps": "many"}, "'env_steps' is not an integer"),
        ({"seed": -1}, "'seed' is not an integer"),
        ({"label": "x" * 501}, "'label' has 501 characters"),
        ({"label": "\udcff"}, "'label' has half a character"),
        ({"host": {"threads": "two"}}, "'threads' is not an integer"),
        ({"timings": {"wall_s": float("nan")}}, "'wall_s' is not a finite number"),
        ({"packages": ["sticks"]}, "'packages' is not an object"),
        (
            {"members": {"task": {"module": "sticks", "package": "sticks", "files": "sticks"}}},
            "'files' is not an object",
        ),
        ({"members": {"task": {"module": "sticks"}}}, "no 'files'"),
        ({"task": 5}, "'task' is not text"),
        ({"timings": {"yesterday": 1}}, "yesterday"),
        ({"alpha": True}, "axis 'alpha' is a bool"),
        ({"code": "main"}, "'code' is not an object"),
        ({"earlier": ["once"]}, "'earlier' is not a list of objects"),
        ({"failure": "it broke"}, "'failure' is not an object"),
    ],
)
def test_a_damaged_record_is_one_clear_error(tmp_path: Path, damage: dict[str, Any], named: str) -> None:
    (tmp_path / "cell.json").write_text(json.dumps({**VERSION_0_1_0, **damage}))
    with pytest.raises(UserError, match=r"cannot read .*cell\.json.*delete its folder") as caught:
        CellRecord.read(tmp_path)
    assert named in str(caught.value)


@pytest.mark.parametrize("text", ['{"status": "do', "[1]", "", "null"])
def test_what_is_no_record_at_all_is_refused_alike(tmp_path: Path, text: str) -> None:
    (tmp_path / "cell.json").write_text(text)
    with pytest.raises(UserError, match=r"cannot read .*cell\.json"):
        CellRecord.read(tmp_path)


def test_an_ended_record_keeps_its_start(tmp_path: Path) -> None:
    record = CellRecord.read(store_cell(tmp_path, timings=Timings(started="2026-01-01T00:00:00+00:00")))
    assert record is not None
    done = record.ended(DONE, env_steps=9, timings=Timings(train_s=1.0, wall_s=2.0))
    assert (done.status, done.env_steps, done.timings.started) == (DONE, 9, "2026-01-01T00:00:00+00:00")
    assert done.timings.ended is not None
    assert done.timings.ended > "2026"


@pytest.mark.parametrize(
    ("failure", "line"), [(Failure("it broke", "a\nb: c\n"), "b: c"), (Failure("it broke"), "it broke")]
)
def test_the_last_line_of_a_failure(failure: Failure, line: str) -> None:
    assert failure.last_line == line


@pytest.mark.parametrize(
    ("method", "label"),
    [
        ({"design_credit": {"value": "separate", "source": "default"}}, "GNN-PPO, separate credit"),
        ({"design_credit": {"value": "joint", "source": "--set"}}, "GNN-PPO, joint credit"),
        ({}, "GNN-PPO"),
    ],
)
def test_a_former_label_gets_the_credit_of_the_design_step(method: dict[str, Any], label: str) -> None:
    config = {**VERSION_0_1_0["config"], "method": method}
    assert CellRecord.from_json({**VERSION_0_1_0, "label": "GNN-PPO (paper's)", "config": config}).label == label
    assert CellRecord.from_json({**VERSION_0_1_0, "config": config}).label == "GNN-PPO"
