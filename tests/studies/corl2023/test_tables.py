"""The numbers of the study `corl2023` are those printed in the paper's LaTeX, and none is missing on either side.

`data/paper_tables.csv` holds the rows as printed, cut out of the LaTeX source by label.
"""

from __future__ import annotations

import ast
import csv
import dataclasses
import re
from collections.abc import Iterator
from decimal import Decimal
from math import prod
from pathlib import Path
from typing import Any

import pytest

from codesign_bench.studies.corl2023.learners import CMA_ES_SWEEP, CMA_RL, LEARNERS, SHARED_ARCH, Swept
from codesign_bench.studies.corl2023.protocol import PROTOCOL, TIMINGS
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT
from codesign_bench.studies.corl2023.scenes import SCENES

Key = tuple[str, str]

TABLES = {
    "push": "table:our_pushing",
    "catch_balls": "table:our_catching",
    "scoop": "table:our_scooping",
    "fetch_cube": "table:our_fetch_cube",
    "lift_cup": "table:our_lift_cup",
    "scoop_3d": "table:our_3d_scoop",
}

PRINTED_FIELDS = {
    "tool_position_init": "Tool Position Init.",
    "tool_length_init": "Tool Length Init.",
    "tool_angle_init": "Tool Angle Init.",
    "control_gnn": "Control GNN",
    "control_index_mlp": "Control Index MLP",
    "design_gnn": "Design GNN",
    "design_index_mlp": "Design Index MLP",
    "control_log_std": "Control Log Std.",
    "design_log_std": "Design Log Std.",
    "fix_std": r"Fix Design \& Control Std.",
    "entropy_weight": r"Entropy $\beta$",
    "kl_threshold": "KL Divergence Threshold",
    "epochs": "PPO Steps Per Batch",
    "sigma0": "Initial Stdev",
    "rank_mu_learning_rate": r"Rank $\mu$ Learning Rate",
    "policy_net": "Poicy Net",
}
"""Printed names (misprints included) of the fields whose names do not follow from ours word by word."""

PRINTED_METHODS = {
    "gnn_ppo": "Ours",
    "shared_arch": "Ours (shared arch)",
    "cma_rl": "CMA-RL",
    "hwasp_minimal": "HWasP-minimal/Ha 2018",
    "cma_es": "CMA-ES",
}

TEXT_ROWS: dict[str, Key] = {
    "total_steps": ("Computational Resources", "total steps"),
    "seeds": ("fig:sample_efficiency", "seeds"),
    "seeds_scoop_3d": ("fig:sample_efficiency", "seeds scoop (3D)"),
    "seeds_generalisation": ("fig:interpolation", "seeds"),
    "cutout_fractions": ("Generalization", "cutout fractions"),
    "fetch_cube_region": ("Generalization", "region"),
    "fetch_cube_patches": ("Generalization", "patch"),
    "fine_tuning_starts": ("Generalization", "fine-tuning starts"),
    "alphas": ("Trading off", "alpha"),
    "fetch_cube_starts": ("tab:real_fetchcube", "Tool"),
    "lift_cup_sizes": ("tab:real_liftcup", "Tool"),
    "trials": ("Real robot evaluation", "trials"),
    "max_steps": ("Real Robot Experiment Details", "environment steps"),
    "fetch_cube_distance": ("Real Robot Experiment Details", "closer than"),
    "lift_cup_height": ("Real Robot Experiment Details", "lifted higher than"),
    "grid_shape": ("fig:detailed_other_inits_results", "grid"),
    "grid_extent": ("fig:detailed_other_inits_results", "total dimension"),
    "near_miss": ("fig:detailed_other_inits_results", "within"),
    "own_successes": ("tab:real_exp", "single init."),
    "grid_successes": ("tab:real_exp", "Fetch cube (grid inits.)"),
}
"""Where the text, captions and tables about experiments print a field of `PROTOCOL` or `REAL_ROBOT`."""
OWN_ROWS = {"fetch_cube": "Fetch cube (single init.)", "lift_cup": "Lift cup"}
"""Rows of the table of trials with each tool on its own instance."""


def printed(field: str) -> str:
    """Return the name under which the paper prints a field."""
    return PRINTED_FIELDS.get(field, field.replace("_", " ").title())


def task_rows() -> Iterator[tuple[Key, Any]]:
    """Yield what the module says for each row of the six tasks' tables."""
    for table in (SCENES, LEARNERS):
        for task, values in table.items():
            for field in dataclasses.fields(values):
                yield (TABLES[task], printed(field.name)), getattr(values, field.name)


def baseline_rows() -> Iterator[tuple[Key, Any]]:
    """Yield what the module says for each row of the baselines' table."""
    for field in dataclasses.fields(CMA_ES_SWEEP):
        yield ("table:baseline_hp", f"CMA-ES: {printed(field.name)}"), getattr(CMA_ES_SWEEP, field.name)
    for name, table in {"CMA-RL": CMA_RL, "Ours(shared arch.)": SHARED_ARCH}.items():
        values = dataclasses.asdict(table)
        values["batch_size"] = (values["batch_size"], values.pop("batch_size_scoop_3d"))
        for field_name, value in values.items():
            yield ("table:baseline_hp", f"{name}: {printed(field_name)}"), value


def text_rows() -> Iterator[tuple[Key, Any]]:
    """Yield what the module says for the timing table and for the numbers about experiments, every field of them."""
    for method, timing in TIMINGS.items():
        yield ("Computational Resources", f"{PRINTED_METHODS[method]}: Training time"), timing.training_minutes
        yield ("Computational Resources", f"{PRINTED_METHODS[method]}: Inference time"), timing.inference_seconds
    for values in (PROTOCOL, REAL_ROBOT):
        for field in dataclasses.fields(values):
            where, name = TEXT_ROWS.get(field.name, ("not printed", field.name))
            for row, value in rows_of(field.name, name, getattr(values, field.name)):
                yield (where, row), value


def rows_of(field: str, name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the printed rows of one field with what the module says: most fields have one, some have one an entry."""
    if field == "fetch_cube_region":
        yield from ((f"{name} {side}", getattr(value, side)) for side in ("x", "y"))
    elif field == "fetch_cube_patches":
        for number, patch in enumerate(value, start=1):
            yield from ((f"{name} {number} {side}", getattr(patch, side)) for side in ("x", "y"))
    elif field in ("fetch_cube_starts", "lift_cup_sizes"):
        yield from ((f"{name} {number}", entry) for number, entry in enumerate(value, start=1))
    elif field == "own_successes":
        for task, successes in value.items():
            yield OWN_ROWS[task], tuple((count, REAL_ROBOT.trials) for count in successes)
    elif field == "grid_successes":
        yield name, tuple((count, prod(REAL_ROBOT.grid_shape)) for count in value)
    else:
        yield name, value


def paper_rows() -> dict[Key, str]:
    """Return the rows as printed; the one misprint that differs between tables is mended."""
    with (Path(__file__).parents[2] / "data" / "paper_tables.csv").open(newline="") as file:
        rows = [(row["table"], row["hyperparameter"], row["value"]) for row in csv.DictReader(file)]
    assert len({row[:2] for row in rows}) == len(rows), "a row of the csv hides another"
    return {(table, name.replace("Actioin", "Action")): value for table, name, value in rows}


def parse(value: str) -> Any:
    """Return the number, flag, tuple, or sweep that a printed value means; lengths in m."""
    best = re.search(r"\\textbf\{(.*?)\}", value)
    value = re.sub(r"\\textbf\{(.*?)\}", r"\1", value)
    value = value.replace("(3D scoop)", "").replace("$", "").replace("and ", "").replace("five", "5")
    value = re.sub(r"([\d.]+)cm", lambda length: str(Decimal(length[1]) / 100), value)  # Ours are in m.
    value = re.sub(r"(\d+)/(\d+)", r"(\1, \2)", value).replace(r"\times", ",").removesuffix("m")
    if value == "N/A":
        return None
    if value.startswith("["):
        value = f"({value[1:-1]})"
    parsed = ast.literal_eval(value.replace("10^7", "1e7"))
    return Swept(parsed, ast.literal_eval(best.group(1))) if best else parsed


PAPER = paper_rows()
MODULE = dict([*task_rows(), *baseline_rows(), *text_rows()])


def test_no_row_of_the_paper_and_no_field_of_the_module_is_left_out() -> None:
    assert set(MODULE) == set(PAPER)


@pytest.mark.parametrize("key", sorted(PAPER), ids=": ".join)
def test_every_number_is_the_printed_one(key: Key) -> None:
    assert MODULE[key] == parse(PAPER[key])


def test_scenes_and_learners_speak_of_the_same_tasks() -> None:
    assert list(SCENES) == list(LEARNERS) == list(TABLES)


def test_scoop_3d_has_its_own_batch_size_and_seeds() -> None:
    assert CMA_RL.batch_size_for("scoop_3d") == 20000
    assert CMA_RL.batch_size_for("push") == 50000
    assert PROTOCOL.seeds_for("scoop_3d") == 3
    assert PROTOCOL.seeds_for("push") == 6
