"""Headroom of policies: what their own controllers earn with other tools than the designer's (ours).

Per task and method, the designer's tool, the best tool that was found for the goal, the designer's best tool for
another goal, and a random tool; all of them with the same controller, acting with its mean. From the first to the
second is what the designer misses. From there to the best known, the dotted line, is what the controller cannot do.
"""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from codesign_bench.errors import UserError
from codesign_bench.figures import source
from codesign_bench.stats import CONFIDENCE, MIN_SEEDS, mean_t_interval
from codesign_bench.storage.frames import default_rows, require_columns
from codesign_bench.storage.headroom import KNOWN, QUANTITIES, TOOLS

from ._order import task_order
from ._style import BLUE, GREEN, GREY, ORANGE, PAGE_WIDTH, SEED_DOTS, in_order, style

TITLE = "Headroom"
SOURCE = source.headroom
NEEDS = "codesign-bench headroom --policy CELL"
NEEDED = (
    *("task", "method", "variant", "seed", "label", "instance", "env_steps"),
    *(f"{tools}_{quantity}" for tools in (*TOOLS, KNOWN) for quantity in QUANTITIES),
)
MARKS = {
    "designer": (BLUE, "o", "designer's tool"),
    "best": (GREEN, "^", "best tool found"),
    "other": (ORANGE, "s", "designer's best tool of another goal"),
    "random": (GREY, "D", "random tool"),
}
"""Whose tool -> colour, marker, legend."""
AXES = {"return": "mean return", "success": "success rate"}
BOUNDS = {"return": (-math.inf, math.inf), "success": (0.0, 1.0)}
"""Range of a quantity, which ends its intervals."""
STEP = 0.17
"""Distance between the tools of a method, where methods are 1 apart."""
ROW_HEIGHT = 0.42
"""Height of a method in a panel, in inches."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per task, method and kind of tool.

    Args:
        frame: rows of `codesign_bench.storage.headroom.load_headroom`; variants other than `default` are left out, and
            of each task the instances that were not measured for all of its cells.

    Returns:
        Columns task, method, label, tool ("designer", "best", "other" or "random"), seeds, instances, then for return
        and success itself, `<quantity>_low` and `<quantity>_high` (t intervals over seeds; NaN for fewer than three)
        and `known_<quantity>` (the best known of the same instances; NaN if it is not known of all), and env_steps (of
        the measurement, mean over seeds).

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    rows = _shared_instances(frame)
    result = []
    for task in task_order(rows["task"]):
        for method in in_order(rows.loc[rows["task"] == task, "method"]):
            own = rows[(rows["task"] == task) & (rows["method"] == method)]
            seeds = _seeds(own)
            for tool in TOOLS:
                row: dict[str, object] = {
                    "task": task,
                    "method": method,
                    "label": own["label"].iloc[0],
                    "tool": tool,
                    "seeds": len(seeds),
                    "instances": own["instance"].nunique(),
                }
                for name in QUANTITIES:
                    values = seeds[f"{tool}_{name}"].to_numpy()
                    low, high = mean_t_interval(values, within=BOUNDS[name])
                    known = float(own[f"{KNOWN}_{name}"].mean(skipna=False))
                    row |= {name: float(values.mean()), f"{name}_low": low, f"{name}_high": high}
                    row |= {f"{KNOWN}_{name}": known}
                result.append({**row, "env_steps": float(own.groupby("seed")["env_steps"].sum().mean())})
    return pd.DataFrame(result)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: for each task a panel of returns and one of success rates, four marks for each method.

    Raises:
        UserError: as `data` does.
    """
    table, rows = data(frame), _shared_instances(frame)
    tasks = task_order(table["task"])
    counts = [int(table.loc[table["task"] == task, "method"].nunique()) for task in tasks]
    with style():
        heights = [ROW_HEIGHT * count + 0.45 for count in counts]
        figure = Figure(figsize=(PAGE_WIDTH, sum(heights) + 0.6), layout="constrained")
        panels = figure.subplots(len(tasks), len(QUANTITIES), squeeze=False, height_ratios=heights)
        for line, task in zip(panels, tasks, strict=True):
            for axes, quantity in zip(line, QUANTITIES, strict=True):
                own, single = (part[part["task"] == task] for part in (table, rows))
                _draw_panel(axes, own, single, quantity)
            line[1].set_yticklabels([])
            line[0].set_title(f"{str(task).replace('_', ' ')}, {own['instances'].iloc[0]} instances", loc="left")
        _add_legend(figure, has_known=bool(table[[f"{KNOWN}_{name}" for name in QUANTITIES]].notna().any(axis=None)))
        figure.draw_without_rendering()
    return figure


def _shared_instances(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of default cells on the instances that were measured for all cells of their task."""
    require_columns(frame, NEEDED, "the tables of headroom")
    rows = default_rows(frame)
    if rows.empty:
        raise UserError("no headroom of variant 'default'")
    cells = rows.groupby("task")[["method", "seed"]].apply(lambda own: len(own.drop_duplicates()))
    measured = rows.groupby(["task", "instance"])["seed"].transform("size")
    shared = rows[measured == rows["task"].map(cells)]
    if missing := sorted(set(rows["task"]) - set(shared["task"])):
        raise UserError(f"cells of {', '.join(missing)} have no measured instance in common")
    return shared


def _seeds(own: pd.DataFrame) -> pd.DataFrame:
    """Return one row per seed of a method: means over instances."""
    return own.groupby("seed")[[f"{tool}_{name}" for tool in TOOLS for name in QUANTITIES]].mean()


def _draw_panel(axes: Axes, table: pd.DataFrame, rows: pd.DataFrame, quantity: str) -> None:
    """Draw one quantity of one task: methods below each other, the four tools of each a little apart."""
    methods = in_order(table["method"])
    for place, method in enumerate(methods):
        own = {str(row["tool"]): row for row in table[table["method"] == method].to_dict("records")}
        seeds = _seeds(rows[rows["method"] == method])
        for offset, (tool, (colour, marker, _)) in enumerate(MARKS.items()):
            height = place + STEP * (offset - (len(MARKS) - 1) / 2)
            low, high = (float(own[tool][f"{quantity}_{end}"]) for end in ("low", "high"))
            axes.plot([low, high], [height, height], color=colour, linewidth=1.2)
            single = seeds[f"{tool}_{quantity}"].tolist()
            axes.plot(single, [height] * len(single), zorder=3, **SEED_DOTS)
            axes.plot([own[tool][quantity]], [height], marker, color=colour, markersize=3.5, gid=f"{method} {tool}")
    known = float(table[f"{KNOWN}_{quantity}"].iloc[0])
    if not math.isnan(known):
        axes.axvline(known, color="#444444", linestyle=":", linewidth=0.7, gid="best known")
    labels = [f"{row['label']} ({row['seeds']})" for row in table.drop_duplicates("method").to_dict("records")]
    axes.set_yticks(range(len(methods)), labels)
    axes.set_ylim(len(methods) - 0.5, -0.5)
    axes.set_xlabel(AXES[quantity])
    if quantity == "success":
        axes.set_xlim(-0.03, 1.03)


def _add_legend(figure: Figure, *, has_known: bool) -> None:
    """Put one legend below the panels."""
    handles = [
        Line2D([], [], color=colour, marker=marker, linestyle="none", markersize=3.5, label=text)
        for colour, marker, text in MARKS.values()
    ]
    if has_known:
        handles.append(Line2D([], [], color="#444444", linestyle=":", linewidth=0.7, label="best known"))
    note = f"mean over seeds (n); small dots: each seed; bars: {CONFIDENCE:.0%} t interval, if {MIN_SEEDS} or more"
    figure.legend(handles=handles, loc="outside lower center", ncols=3, title=note, title_fontsize=5.5)
