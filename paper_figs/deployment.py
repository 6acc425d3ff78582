"""Tools and policies on a simulated robot arm (the paper's `tab:real_exp` and `fig:detailed_other_inits_results`).

Top: successes of each tool on the instance it was designed for and on the grid of starts, with the paper's real robot
in brackets. Bottom: the grid of each fetch-cube tool, seen from above, with the robot's base at the bottom. Where
several policies were deployed, every field has one strip for each, in the order of their seeds.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Rectangle

from codesign_bench.figures.source import trials_on_an_arm
from codesign_bench.storage.frames import require_columns
from codesign_bench.studies.corl2023.real_robot import REAL_ROBOT
from codesign_bench.text_tables import latex, markdown

from ._order import task_order
from ._style import PAGE_WIDTH, draw_table, style

TITLE = "Deployment on a simulated arm"
SOURCE = trials_on_an_arm
NEEDS = "codesign-bench deploy --policy CELL --protocol"
OWN, GRID = "own", "grid"
NEEDED = (
    *("task", "kind", "tool", "trial", "row", "column", "success", "near", "steps"),
    *("tracking_error_mean_mm", "tracking_error_max_mm", "unreachable_steps", "scene_contact_steps"),
)
GRID_TASK = "fetch_cube"
SUCCESS = ("#009E73", "S", "success")
NEAR = ("#E69F00", "n", f"failure within {100.0 * REAL_ROBOT.near_miss:.0f} cm of success")
FAILURE = ("#D55E00", "F", "failure")
"""Green, orange and red of Okabe and Ito (2008), each with a letter for readers who cannot distinguish them."""
ROW_NAMES = {OWN: "own instance", GRID: "grid of starts"}
SEED = "policy_seed"
NOTE = "Successes on the simulated arm{policies} (in brackets: the paper's, on the real one)"
TABLE_HEIGHT, MAP_HEIGHT = 1.1, 1.8
"""In inches."""
BASE_ROOM = 1.1
"""Height of the strip below a map in which the base is drawn, in fields."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per task, kind of trial and tool.

    Args:
        frame: one row per trial, from `codesign_bench.deployment.tables.load_deployment`.

    Returns:
        Columns task, kind, tool, successes, near (failures within 5 cm of success), trials, paper_successes,
        paper_trials, steps (mean), tracking_error_mean_mm, tracking_error_max_mm, and the sums of every column that
        ends in `_steps`, in control steps.

    Raises:
        UserError: a column is missing, or there is no row.
    """
    require_columns(frame, NEEDED, "the trials")
    rows = []
    for task in task_order(frame["task"]):
        for kind in (OWN, GRID):
            own = frame[(frame["task"] == task) & (frame["kind"] == kind)]
            rows += [_row(task, kind, int(str(tool)), trials) for tool, trials in own.groupby("tool")]
    return pd.DataFrame(rows)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: the table, and a map for each tool of the grid.

    Raises:
        UserError: as `data` does.
    """
    header, cells = _cells(data(frame))
    grid = frame[(frame["task"] == GRID_TASK) & (frame["kind"] == GRID)]
    if SEED in grid.columns:
        grid = grid.sort_values(SEED, kind="stable")
    tools = sorted(grid["tool"].unique().tolist())
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, TABLE_HEIGHT + (MAP_HEIGHT if tools else 0.0)), layout="constrained")
        heights = (TABLE_HEIGHT, MAP_HEIGHT) if tools else (TABLE_HEIGHT,)
        top, *below = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
        axes = top.subplots()
        draw_table(axes, header, cells)
        axes.set_title(_note(frame), fontsize=7)
        if tools:
            (bottom,) = below
            maps = bottom.subplots(1, len(tools), squeeze=False)[0]
            for axis, tool in zip(maps, tools, strict=True):
                _draw_map(axis, grid[grid["tool"] == tool], tool)
            handles = [
                Patch(facecolor=colour, edgecolor="black", linewidth=0.4, label=f"{letter}: {name}")
                for colour, letter, name in (SUCCESS, NEAR, FAILURE)
            ]
            bottom.legend(handles=handles, loc="outside lower center", ncols=3)
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the table as text by file ending: Markdown and LaTeX.

    Raises:
        UserError: as `data` does.
    """
    header, rows = _cells(data(frame))
    return {"md": markdown(header, rows), "tex": latex(header, rows)}


def _row(task: str, kind: str, tool: int, trials: pd.DataFrame) -> dict[str, object]:
    own = REAL_ROBOT.own_successes.get(task, ())
    rows, columns = REAL_ROBOT.grid_shape
    paper = own if kind == OWN else REAL_ROBOT.grid_successes
    counted = [column for column in trials.columns if column.endswith("_steps")]
    return {
        "task": task,
        "kind": kind,
        "tool": tool,
        "successes": int(trials["success"].sum()),
        "near": int(trials["near"].sum()),
        "trials": len(trials),
        "paper_successes": paper[tool - 1] if 1 <= tool <= len(paper) else float("nan"),
        "paper_trials": REAL_ROBOT.trials if kind == OWN else rows * columns,
        "steps": float(trials["steps"].mean()),
        "tracking_error_mean_mm": float((trials["tracking_error_mean_mm"] * trials["steps"]).sum())
        / max(int(trials["steps"].sum()), 1),
        "tracking_error_max_mm": float(trials["tracking_error_max_mm"].max()),
        **{column: int(trials[column].sum()) for column in counted},
    }


def _cells(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of text: successes here, and those of the paper in brackets."""
    tools = sorted(table["tool"].unique().tolist())
    header = ["", *(f"tool {tool}" for tool in tools), "tracking error", "unreachable", "touched scene"]
    rows = []
    for (task, kind), own in table.groupby(["task", "kind"], sort=False):
        by_tool = own.set_index("tool")
        steps = float((own["steps"] * own["trials"]).sum())
        error = float((own["tracking_error_mean_mm"] * own["steps"] * own["trials"]).sum()) / max(steps, 1.0)
        rows.append(
            [
                f"{str(task).replace('_', ' ')}, {ROW_NAMES[str(kind)]}",
                *(_success(by_tool.loc[tool]) if tool in by_tool.index else "-" for tool in tools),
                f"{error:.1f} mm, at most {own['tracking_error_max_mm'].max():.0f}",
                f"{own['unreachable_steps'].sum() / max(steps, 1.0):.1%} of steps",
                f"{own['scene_contact_steps'].sum() / max(steps, 1.0):.1%}",
            ]
        )
    return header, rows


def _success(row: pd.Series) -> str:
    paper = "" if pd.isna(row["paper_successes"]) else f" ({int(row['paper_successes'])}/{int(row['paper_trials'])})"
    return f"{int(row['successes'])}/{int(row['trials'])}{paper}"


def _note(frame: pd.DataFrame) -> str:
    """Return the title of the table, which says how many policies of a task share its numbers."""
    counts = frame.groupby("task")[SEED].nunique() if SEED in frame.columns else pd.Series([1])
    fewest, most = int(counts.min()), int(counts.max())
    number = str(most) if fewest == most else f"{fewest} to {most}"
    return NOTE.format(policies=f" of {number} policies each" if most > 1 else "")


def _draw_map(axes: Axes, trials: pd.DataFrame, tool: int) -> None:
    """Draw the grid of one tool, with the row farthest from the robot at the top and the base at the bottom.

    A field has one strip per trial, in the order of the policies' seeds.
    """
    rows, columns = int(trials["row"].max()) + 1, int(trials["column"].max()) + 1
    for _, field in trials.groupby(["row", "column"]):
        x, y = float(field["column"].iloc[0]), float(rows - 1 - int(field["row"].iloc[0]))
        width = 1.0 / len(field)
        kinds = [
            SUCCESS if success else NEAR if near else FAILURE
            for success, near in zip(field["success"], field["near"], strict=True)
        ]
        for strip, (colour, _, _) in enumerate(kinds):
            axes.add_patch(Rectangle((x + strip * width, y), width, 1.0, facecolor=colour, linewidth=0.0))
        axes.add_patch(Rectangle((x, y), 1.0, 1.0, fill=False, edgecolor="black", linewidth=0.6))
        text = kinds[0][1] if len(kinds) == 1 else f"{kinds.count(SUCCESS)}/{len(kinds)}"
        axes.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=7)
    axes.add_patch(Circle((0.5 * columns, -0.45), 0.3, facecolor="black"))
    axes.text(0.5 * columns + 0.45, -0.45, "base", ha="left", va="center", fontsize=6)
    axes.set_xlim(0.0, columns)
    axes.set_ylim(-BASE_ROOM, rows)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(f"tool {tool}: {int(trials['success'].sum())} of {len(trials)}", fontsize=7)
