"""Curves of every method on every task over environment steps, shared by the learning-curve figures."""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, MaxNLocator

from codesign_bench.errors import UserError
from codesign_bench.figures.comparison import is_compared
from codesign_bench.stats import on_common_grid
from codesign_bench.storage.frames import default_rows, require_columns
from codesign_bench.storage.reference_points import POINTS, reference_points_in

from ._order import task_order
from ._style import BAND_OPACITY, COLUMN_WIDTH, PAGE_WIDTH, Dashes, in_order, line_styles, style

QUANTITIES = {"return_mean": "mean return", "success_rate": "success rate"}
"""Columns drawn, one row of panels each, and their names on the axes."""
PANELS_PER_ROW = 3
PANEL_HEIGHT = 1.5
"""Height of a panel, in inches."""
MOST_IN_A_COLUMN = 8
"""Methods whose names fit below a single panel of a column's width; with more the figure is as wide as the page."""
SLIVER = 0.05
"""Fraction of a curve's length below which a piece is too short to see."""
REFERENCE_WIDTH = 0.7
"""Of a line, in points: about half a curve's."""
REFERENCE_STYLES: dict[str, tuple[str, tuple[float, tuple[float, ...]]]] = {
    "idle": ("#999999", (0.0, (1.0, 2.0))),
    "random_tool": ("#999999", (0.0, (4.0, 2.0))),
    "script": ("#444444", (0.0, ())),
    "best_single_tool": ("#444444", (0.0, (5.0, 1.5, 1.0, 1.5))),
    "best_known": ("#444444", (0.0, (1.0, 1.0))),
}
"""Colour and dashes of the line of each reference point; light ones need no skill."""
NEEDED = ("env_steps", "task", "method", "variant", "seed", *QUANTITIES)


def evaluated_rows(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the evaluated rows of the variant `default` of a frame from `codesign_bench.load_results`.

    Raises:
        UserError: a column, or every row of the default variant, is missing.
    """
    require_columns(frame, NEEDED, "the results")
    rows = default_rows(frame)
    rows = rows[rows["return_mean"].notna()]
    if rows.empty:
        raise UserError("no evaluated cell of variant 'default'")
    return rows


def reference_texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the reference points in a frame as the text of a file, by its ending; nothing if there are none."""
    points = reference_points_in(frame)
    return {} if points.empty else {"references.csv": points.to_csv(index=False, lineterminator="\n")}


def seed_curves(rows: pd.DataFrame) -> pd.DataFrame:
    """Return each seed's curve: columns task, method, quantity, seed, env_steps, value."""
    parts = (on_common_grid(rows, name).rename(columns={name: "value"}).assign(quantity=name) for name in QUANTITIES)
    return pd.concat(parts, ignore_index=True)


def draw_curves(
    table: pd.DataFrame,
    labels: dict[str, str],
    note: str,
    references: pd.DataFrame | None = None,
    seeds: pd.DataFrame | None = None,
) -> Figure:
    """Return for each task a panel of returns above one of success rates, and one legend with seed counts.

    Args:
        table: columns task, method, quantity (a key of `QUANTITIES`), env_steps, centre, low, high (NaN where there is
            no interval), seeds (the number that reached this step).
        labels: names of methods in the legend, if they differ from the method's.
        note: explanation of lines and bands.
        references: levels to draw as thin grey lines, rows of `reference_points_in`; None: none.
        seeds: rows of `seed_curves`, drawn as thin lines; None: none.
    """
    drawn = pd.DataFrame(columns=["task", "quantity", "method", "seed"]) if seeds is None else seeds
    levels = pd.DataFrame(columns=["task", "point"]) if references is None else references
    styles = line_styles(table["method"])
    tasks = task_order(table["task"])
    columns = min(len(tasks), PANELS_PER_ROW)
    rows = len(QUANTITIES) * math.ceil(len(tasks) / columns)
    narrow = columns == 1 and not _compares(table) and table["method"].nunique() <= MOST_IN_A_COLUMN
    width = COLUMN_WIDTH if narrow else PAGE_WIDTH
    with style():
        height = rows * PANEL_HEIGHT + (0.9 if levels.empty else 1.2)
        figure = Figure(figsize=(width, height), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False)
        for position, task in enumerate(tasks):
            block, column = divmod(position, columns)
            top = len(QUANTITIES) * block
            for row, quantity in enumerate(QUANTITIES, start=top):
                curves = table[(table["task"] == task) & (table["quantity"] == quantity)]
                single = drawn[(drawn["task"] == task) & (drawn["quantity"] == quantity)]
                _draw_panel(axes[row, column], curves, single, quantity, styles)
                draw_references(axes[row, column], levels[levels["task"] == task], quantity)
            axes[top, column].set_title(str(task).replace("_", " "))
        for axis in axes.flat:
            axis.set_visible(axis.has_data())
        _add_legend(figure, table, labels, note, columns=_legend_columns(table, narrow), points=set(levels["point"]))
        figure.draw_without_rendering()  # ticks take their settings when first drawn, so within these settings
    return figure


def method_labels(frame: pd.DataFrame) -> dict[str, str]:
    """Return the legend's names of the methods, if the frame has any."""
    if "label" not in frame.columns:
        return {}
    known = frame.dropna(subset=["label"]).drop_duplicates("method")
    return dict(zip(known["method"], known["label"], strict=True))


def _draw_panel(
    axes: Axes, curves: pd.DataFrame, seeds: pd.DataFrame, quantity: str, styles: dict[str, tuple[str, Dashes]]
) -> None:
    """Draw one quantity of one task."""
    for method in reversed(in_order(curves["method"])):  # the paper's own method on top
        draw_seeds(axes, seeds[seeds["method"] == method], styles[method][0], gid=method)
        draw_curve(axes, curves[curves["method"] == method], *styles[method], gid=method)
    axes.set_xlabel("environment steps")
    axes.set_ylabel(QUANTITIES[quantity])
    axes.xaxis.set_major_formatter(EngFormatter(sep=""))
    axes.xaxis.set_major_locator(MaxNLocator(5))
    if quantity == "success_rate":
        axes.set_ylim(-0.03, 1.03)


def draw_references(axes: Axes, points: pd.DataFrame, quantity: str) -> None:
    """Draw a thin line across the panel for each reference point of one task, below the curves."""
    for row in points.to_dict("records"):
        colour, dashes = REFERENCE_STYLES[str(row["point"])]
        level, name = float(row[quantity]), f"reference {row['point']}"
        axes.axhline(level, color=colour, linestyle=dashes, linewidth=REFERENCE_WIDTH, zorder=1.5, gid=name)


def draw_seeds(axes: Axes, seeds: pd.DataFrame, colour: str, gid: str) -> None:
    """Draw a thin line for each seed, given columns seed, env_steps, value: a mean of few hides those that fail."""
    for seed, curve in seeds.groupby("seed"):
        axes.plot(curve["env_steps"], curve["value"], color=colour, linewidth=0.3, alpha=0.5, gid=f"{gid} seed {seed}")


def draw_curve(axes: Axes, curve: pd.DataFrame, colour: str, dashes: Dashes, gid: str) -> None:
    """Draw one line and its band; the line is dotted where some seeds are missing.

    Args:
        curve: columns env_steps, centre, low, high (NaN without interval), seeds (the number that reached this step).
        gid: names the line in a test or an SVG.
    """
    curve = _without_slivers(curve)
    complete = curve["seeds"] == curve["seeds"].max()
    steps, values = curve["env_steps"], curve["centre"]
    axes.plot(steps, values.where(complete), color=colour, linestyle=dashes, gid=gid)
    if not complete.all():
        # Dotted pieces start and end on solid ones.
        dotted = ~complete | ~complete.shift(-1, fill_value=True) | ~complete.shift(1, fill_value=True)
        axes.plot(steps, values.where(dotted), color=colour, linestyle=":", gid=f"{gid} (fewer seeds)")
    if curve["low"].notna().any():
        axes.fill_between(steps, curve["low"], curve["high"], color=colour, alpha=BAND_OPACITY, linewidth=0)


def _without_slivers(curve: pd.DataFrame) -> pd.DataFrame:
    """Cut off ends of a curve that not all seeds reach and that are too short to see.

    Batches consist of whole episodes, so the last evaluations of seeds are a few steps apart. The few seeds with the
    most steps would appear as a spike at the end of the line. Tables keep these rows.
    """
    steps = curve["env_steps"]
    complete = steps[curve["seeds"] == curve["seeds"].max()]
    sliver = SLIVER * steps.max()
    first = complete.min() if complete.min() - steps.min() < sliver else steps.min()
    last = complete.max() if steps.max() - complete.max() < sliver else steps.max()
    return curve[(steps >= first) & (steps <= last)]


def _add_legend(
    figure: Figure, table: pd.DataFrame, labels: dict[str, str], note: str, columns: int, points: set[str]
) -> None:
    """Put one legend below the panels: methods with their numbers of seeds, reference points, what the bands mean."""
    styles = line_styles(table["method"])
    handles = []
    for method in in_order(table["method"]):
        colour, dashes = styles[method]
        label = f"{labels.get(method, method)} (n={_seed_count(table[table['method'] == method])})"
        handles.append(Line2D([], [], color=colour, linestyle=dashes, label=label))
    for point in (name for name in POINTS if name in points):
        colour, pattern = REFERENCE_STYLES[point]
        label = point.replace("_", " ")
        handles.append(Line2D([], [], color=colour, linestyle=pattern, linewidth=REFERENCE_WIDTH, label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, title=note, title_fontsize=5.5)


def _legend_columns(table: pd.DataFrame, narrow: bool) -> int:
    """Return the number of columns of the legend."""
    return 2 if narrow or _compares(table) else 3


def _compares(table: pd.DataFrame) -> bool:
    """Return whether there are compared results, which have long names."""
    return any(is_compared(name) for name in table["method"].unique())


def _seed_count(rows: pd.DataFrame) -> str:
    """Return a method's number of seeds, or its range over the tasks."""
    counts = rows.groupby("task")["seeds"].max()
    low, high = int(counts.min()), int(counts.max())
    return str(high) if low == high else f"{low}-{high}"
