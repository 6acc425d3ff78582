"""The tables beside the cells that commands of the core write, and the form of each.

OUT/reference_points.csv, reference_points.instances.csv   what tasks give without learning
OUT/design_sensitivity/<task>.csv                          many tools on many goals
OUT/outside_region/<task>-<method>[-<variant>].csv         policies around the training region
OUT/cutout_regions/<task>-<method>.csv                     policies with and without a cutout, on each region
OUT/deployment/<task>/protocol*.csv                        trials on an arm
OUT/best_known/<task>.csv                                  the best episodes that are known of every instance
OUT/headroom/<task>-<method>[-<variant>]-seed-00.csv       other tools under a policy's controller
OUT/design_values/<task>-<method>[-<variant>]-seed-00.csv  tools as a policy judges them, and as they play
"""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from codesign_bench.storage.reading import UnusableFile
from codesign_bench.storage.tables import Content, Form, Measurements, read_table

if TYPE_CHECKING:
    import pandas as pd

NUMBER, SHARE, TEXT, WHOLE = Content.NUMBER, Content.SHARE, Content.TEXT, Content.WHOLE

REFERENCE_POINTS = Measurements(
    "reference_points.csv",
    Form(
        {
            "task": TEXT,
            "task_version": WHOLE,
            "point": TEXT,
            "return_mean": NUMBER,
            "success_rate": SHARE,
            "instances": WHOLE,
            "tools": WHOLE,
            "source": TEXT,
        },
        unique=("task", "point"),
    ),
)
REFERENCE_INSTANCES = Measurements(
    "reference_points.instances.csv",
    Form(
        {
            "task": TEXT,
            "task_version": WHOLE,
            "point": TEXT,
            "instance": WHOLE,
            "return": NUMBER,
            "success": SHARE,
            "source": TEXT,
        },
        unique=("task", "point", "instance"),
        alike=("task", "point"),
    ),
)
DESIGN_SENSITIVITY = Measurements(
    "design_sensitivity/*.csv",
    Form(
        {
            "task": TEXT,
            "tool": WHOLE,
            "kind": TEXT,
            "goal": WHOLE,
            "own": SHARE,
            "outcome": NUMBER,
            "return": NUMBER,
            "success": SHARE,
            "outcome_name": TEXT,
            "outcome_unit": TEXT,
        },
        unique=("task", "tool", "goal"),
        alike=("task", "tool"),
    ),
)
OUTSIDE_REGION = Measurements(
    "outside_region/*.csv",
    Form(
        {
            "task": TEXT,
            "method": TEXT,
            "seed": WHOLE,
            "instance": WHOLE,
            "return": NUMBER,
            "success": SHARE,
            "instance_*": NUMBER,
        },
        unique=("seed", "instance"),
        alike=("seed",),
    ),
)
CUTOUT_REGIONS = Measurements(
    "cutout_regions/*.csv",
    Form(
        {
            "task": TEXT,
            "method": TEXT,
            "cutout": SHARE,
            "region": SHARE,
            "seed": WHOLE,
            "instance": WHOLE,
            "return": NUMBER,
            "success": SHARE,
        },
        unique=("cutout", "region", "seed", "instance"),
        alike=("task", "cutout", "region", "seed"),
    ),
)
DEPLOYMENT = Measurements(
    "deployment/*/protocol*.csv",
    Form(
        {
            "task": TEXT,
            "kind": TEXT,
            "tool": WHOLE,
            "trial": NUMBER,
            "row": NUMBER,
            "column": NUMBER,
            "instance_*": NUMBER,
            "policy_seed*": WHOLE,
            "solved_in_training*": SHARE,
            "success": SHARE,
            "near": SHARE,
            "lost": SHARE,
            "steps": WHOLE,
            "*_steps": WHOLE,
            "outcome": NUMBER,
            "tracking_error_mean_mm": NUMBER,
            "tracking_error_max_mm": NUMBER,
        },
        unique=("kind", "tool", "trial", "row", "column"),
        alike=("kind", "tool"),
    ),
)
INSTANCE_OF_A_POLICY = {
    "task": TEXT,
    "task_version": WHOLE,
    "method": TEXT,
    "variant": TEXT,
    "seed": WHOLE,
    "label": TEXT,
    "policy": TEXT,
    "instance": WHOLE,
}
"""Columns that name a policy and an instance on which it was measured."""
HEADROOM = Measurements(
    "headroom/*.csv",
    Form(
        {
            **INSTANCE_OF_A_POLICY,
            "designer_return": NUMBER,
            "designer_success": SHARE,
            "best_return": NUMBER,
            "best_success": SHARE,
            "other_return": NUMBER,
            "other_success": SHARE,
            "random_return": NUMBER,
            "random_success": SHARE,
            "found_by": TEXT,
            "env_steps": WHOLE,
            "candidates": WHOLE,
            "popsize": WHOLE,
            "sigma0": NUMBER,
            "random_tools": WHOLE,
            "other_tools": WHOLE,
            "instance_*": NUMBER,
            "design_*": NUMBER,
        },
        unique=("instance",),
    ),
)
DESIGN_VALUES = Measurements(
    "design_values/*.csv",
    Form(
        {
            **INSTANCE_OF_A_POLICY,
            "tool": WHOLE,
            "origin": TEXT,
            "value": NUMBER,
            "return": NUMBER,
            "success": SHARE,
        },
        unique=("instance", "tool"),
        alike=("instance",),
    ),
)
BEST_KNOWN_EPISODES = Measurements(
    "best_known/*.csv",
    Form(
        {
            "task": TEXT,
            "task_version": WHOLE,
            "instance": WHOLE,
            "return": NUMBER,
            "success": SHARE,
            "episode_length": WHOLE,
            "source": TEXT,
            "searched": WHOLE,
            "plan": TEXT,
            "instance_*": NUMBER,
            "design_*": NUMBER,
        },
        unique=("success", "instance"),
    ),
)
PLANS_SUFFIX = ".safetensors"
"""Ending of the file with the plans that a table of best known episodes names, which lies beside the table."""
BEST_KNOWN_PLANS = str(PurePosixPath(BEST_KNOWN_EPISODES.pattern).with_suffix(PLANS_SUFFIX))
"""Pattern of these files."""
ALL = (
    REFERENCE_POINTS,
    REFERENCE_INSTANCES,
    DESIGN_SENSITIVITY,
    OUTSIDE_REGION,
    CUTOUT_REGIONS,
    DEPLOYMENT,
    HEADROOM,
    DESIGN_VALUES,
    BEST_KNOWN_EPISODES,
)


def paths_of(results: Path, kind: Measurements) -> list[Path]:
    """Return the paths of all tables of a kind, in order, also of those that cannot be used."""
    if "*" not in kind.pattern:  # glob passes over a link to nothing
        return [results / kind.pattern]
    return sorted(results.glob(kind.pattern))


def usable(path: Path, kind: Measurements) -> pd.DataFrame | None:
    """Return the table in `path`, or None if there is none that can be used; `survey` says why."""
    try:
        return read_table(path, kind.form)
    except UnusableFile:
        return None


def usable_tables(results: Path, kind: Measurements) -> list[pd.DataFrame]:
    """Return all tables of a kind that can be used, in order of path; `survey` names the others."""
    found = (usable(path, kind) for path in paths_of(results, kind))
    return [table for table in found if table is not None]
