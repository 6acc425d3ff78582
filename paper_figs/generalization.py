"""Held-out goals and starts (the paper's figures `fig:interpolation_map` and `_curve`).

The paper's claim: "As the area of the cutout region increases, the performance on unseen goals degrades gracefully and
can still solve a significant portion of unseen tasks." Left: which starts are solved with one fraction cut out. Right:
the return by region over the fractions, and what policies that saw everything earn on the starts of the cutout region:
the paper lacks this line, without which an easy region looks like generalisation. Starts outside the training region
are drawn if they were evaluated.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import PercentFormatter

from codesign_bench.figures.generalization import outcomes_by_region
from codesign_bench.stats import MIN_SEEDS, mean, standard_error
from codesign_bench.storage.frames import require_columns

from ._order import task_order
from ._style import GREEN, GREY, ORANGE, PAGE_WIDTH, PINK, Dashes, in_order, style

TITLE = "Generalisation to unseen goals"
SOURCE = outcomes_by_region
NEEDS = "codesign-bench run --method M --task T --seeds 3 --cutout 0.1 0.2 0.4 0.6 0.8 0.9"
NEEDED = (
    *("task", "method", "label", "cutout", "seed", "instance", "return", "success"),
    *("kind", "region", "x", "y", "x_label", "y_label"),
)
MAP_FRACTION = 0.6
"""The paper's fraction in the map; the nearest fraction in the results is drawn."""
KEYS = ["task", "method", "label", "cutout", "region"]
SEEN = "seen"
"""Region of the numbers of policies that were trained on everything, on the starts of the cutout region."""
PANEL_HEIGHT = 2.1
"""Height of a row of panels, in inches."""

REGIONS: dict[str, tuple[str, Dashes, str, str]] = {
    "training": (GREEN, "-", "o", "training region"),
    "cutout": (ORANGE, "--", "s", "cutout region (unseen)"),
    SEEN: (GREY, "-", "D", "cutout region, by policies trained on everything"),
    "outside": (PINK, "-.", "^", "outside the training region (unseen)"),
}
"""Lines: colour, dashes, marker and name."""
NOTE = f"right: mean over seeds; dots: each seed; bars: ± standard error, if {MIN_SEEDS} seeds or more"


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers of the right panels.

    Args:
        frame: from `codesign_bench.figures.generalization`; fraction 0 is training on the whole region.

    Returns:
        Columns task, method, label, cutout, region (`SEEN` for the cutout region as policies play it that were trained
        on everything), return_mean, standard_error (NaN for fewer than three seeds), success_rate, seeds, starts
        (evaluation instances in the region).

    Raises:
        UserError: a column, or every evaluation, is missing.
    """
    grouped = _seeds(frame).groupby(KEYS)
    table = grouped.agg(
        return_mean=("value", mean),
        standard_error=("value", standard_error),
        success_rate=("success", mean),
        seeds=("seed", "nunique"),
        starts=("starts", "max"),
    )
    return table.reset_index()


def _seeds(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per region and seed, with the columns `KEYS`, seed, value (mean return), success, starts."""
    played = frame[frame["kind"] == "compared"].assign(region=SEEN)
    grouped = pd.concat([_starts(frame), played]).groupby([*KEYS, "seed"], as_index=False)
    return grouped.agg(value=("return", "mean"), success=("success", "mean"), starts=("instance", "nunique"))


def draw(frame: pd.DataFrame) -> Figure:
    """Return the figure: for each task and method, a map of starts and the return over the fractions.

    Raises:
        UserError: as `data` does.
    """
    starts, table, seeds = _starts(frame), data(frame), _seeds(frame)
    pairs = _pairs(starts)
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, PANEL_HEIGHT * len(pairs) + 0.5), layout="constrained")
        axes = figure.subplots(len(pairs), 2, squeeze=False, width_ratios=(1.5, 1.0))
        for (left, right), (task, method) in zip(axes, pairs, strict=True):
            own = starts[(starts["task"] == task) & (starts["method"] == method)]
            fraction = _map_fraction(own)
            places = frame[(frame["kind"] == "place") & (frame["task"] == task) & (frame["cutout"] == fraction)]
            _draw_map(figure, left, own[own["cutout"] == fraction], places)
            part, single = (rows[(rows["task"] == task) & (rows["method"] == method)] for rows in (table, seeds))
            _draw_returns(right, part, single)
        shown = [REGIONS[region] for region in REGIONS if region in set(table["region"])]
        handles = [Line2D([], [], color=c, linestyle=d, marker=m, ms=3, label=text) for c, d, m, text in shown]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, title=NOTE, title_fontsize=5.5)
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the numbers of the maps as a separate table, one row per start.

    Raises:
        UserError: as `data` does.
    """
    starts = _starts(frame)
    rows = [_solved(own[own["cutout"] == _map_fraction(own)]) for own in _groups(starts)]
    return {"map.csv": pd.concat(rows).to_csv(index=False, lineterminator="\n")}


def _starts(frame: pd.DataFrame) -> pd.DataFrame:
    require_columns(frame, NEEDED, "the evaluations")
    starts = frame[frame["kind"] == "start"]
    require_columns(starts, NEEDED, "the evaluations")
    return starts


def _pairs(starts: pd.DataFrame) -> list[tuple[str, str]]:
    return [
        (task, method)
        for task in task_order(starts["task"])
        for method in in_order(starts.loc[starts["task"] == task, "method"])
    ]


def _groups(starts: pd.DataFrame) -> list[pd.DataFrame]:
    return [starts[(starts["task"] == task) & (starts["method"] == method)] for task, method in _pairs(starts)]


def _map_fraction(own: pd.DataFrame) -> float:
    """Return the fraction nearest to the paper's."""
    return min(own["cutout"].unique().tolist(), key=lambda fraction: (abs(fraction - MAP_FRACTION), fraction))


def _solved(own: pd.DataFrame) -> pd.DataFrame:
    """Return one row per start: its position, and the fraction of seeds that solve it."""
    keys = ["task", "method", "cutout", "region", "instance", "x", "y"]
    grouped = own.groupby(keys, dropna=False, as_index=False)
    return grouped.agg(solved=("success", "mean"), return_mean=("return", "mean"), seeds=("seed", "nunique")).astype(
        {"instance": int}
    )


def _draw_map(figure: Figure, axes: Axes, own: pd.DataFrame, places: pd.DataFrame) -> None:
    """Draw every start of one task, method and fraction, coloured by the fraction of seeds that solve it."""
    solved = _solved(own)
    flat = bool(solved["y"].isna().all())
    height = solved["solved"] if flat else solved["y"]
    points = axes.scatter(
        solved["x"], height, c=solved["solved"], cmap="cividis", vmin=0.0, vmax=1.0, s=11, linewidths=0, gid="starts"
    )
    if flat:
        _shade_line(axes, places)
        axes.set_ylim(-0.05, 1.05)
        axes.set_ylabel("share of seeds that solve it")
    else:
        _outline(axes, places)
        axes.set_aspect("equal")
        axes.set_ylabel(own["y_label"].iloc[0])
        figure.colorbar(points, ax=axes, pad=0.02).set_label("share of seeds that solve it")
    axes.set_xlabel(own["x_label"].iloc[0])
    axes.grid(visible=False)
    if len(places):
        axes.set_xlim(places["x"].min(), places["x"].max())
    first = own.iloc[0]
    share = f"{first['cutout']:.0%} cut out" if first["cutout"] else "nothing cut out"
    task = str(first["task"]).replace("_", " ")
    axes.set_title(f"{task}, {first['label']}: {share} (n={own['seed'].nunique()})", fontsize=7)


def _outline(axes: Axes, places: pd.DataFrame) -> None:
    """Draw the borders of the training region and of the cutout region."""
    for region, inside in (("training", places["region"] != "outside"), ("cutout", places["region"] == "cutout")):
        if not inside.any():
            continue
        colour, dashes, *_ = REGIONS[region]
        grid = places.assign(inside=inside.astype(float)).pivot(index="y", columns="x", values="inside")
        axes.contour(
            grid.columns, grid.index, grid.to_numpy(), levels=[0.5], colors=colour, linestyles=dashes, linewidths=1.2
        )


def _shade_line(axes: Axes, places: pd.DataFrame) -> None:
    """Shade the intervals of a line that belong to either region."""
    ordered = places.sort_values("x")
    for region in ("training", "cutout"):
        axes.fill_between(
            ordered["x"], -1.0, 2.0, where=ordered["region"] == region, color=REGIONS[region][0], alpha=0.2, linewidth=0
        )


def _draw_returns(axes: Axes, table: pd.DataFrame, seeds: pd.DataFrame) -> None:
    """Draw the return in each region over the cutout fraction, its mean and each seed."""
    for region, (colour, dashes, marker, _) in REGIONS.items():
        own = table[table["region"] == region].sort_values("cutout")
        if len(own):
            single = seeds[seeds["region"] == region]
            axes.plot(single["cutout"], single["value"], ".", color=colour, markersize=2.5, alpha=0.5)
            axes.errorbar(
                own["cutout"],
                own["return_mean"],
                own["standard_error"],
                color=colour,
                linestyle=dashes,
                marker=marker,
                markersize=3,
                capsize=2,
                elinewidth=0.8,
                label=region,
            )
    low, high = int(table["seeds"].min()), int(table["seeds"].max())
    axes.set_title(f"n={low}" if low == high else f"n={low}-{high}", fontsize=7)
    axes.set_xlim(-0.04, 1.0)
    axes.xaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlabel("cut out of the training region")
    axes.set_ylabel("mean return")
