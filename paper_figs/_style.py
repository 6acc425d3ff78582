"""The style of all figures: fixed colours, sizes for a two-column paper, and a backend that needs no display.

Colours are those of Okabe and Ito (2008), which readers with any common colour blindness can tell apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.axes import Axes

from codesign_bench.figures.comparison import is_compared, method_of
from codesign_bench.registry import in_order as in_listed_order

mpl.use("Agg")

Dashes = Literal["-", "--", "-."]

COLOURS = {
    "gnn_ppo": "#0072B2",
    "shared_arch": "#E69F00",
    "cma_rl": "#009E73",
    "hwasp_minimal": "#D55E00",
    "cma_es": "#CC79A7",
}
"""Colour of each of the paper's five methods, in the order of its legends."""

OTHER_COLOURS = ("#56B4E9", "#000000", "#999999")
"""Colours of all other methods, in turn; after the last, the dashes change."""

BLUE, ORANGE, GREEN, RED, PINK, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#999999"
"""The same palette for everything other than methods."""

DASHES: tuple[Dashes, ...] = ("-", "--", "-.")

COLUMN_WIDTH = 3.4
"""Width of one column, in inches."""
PAGE_WIDTH = 7.0
"""Width of both columns, in inches."""
BAND_OPACITY = 0.2
SEED_DOTS: Mapping[str, Any] = {
    "marker": "o",
    "linestyle": "none",
    "color": "black",
    "markersize": 2.2,
    "markeredgecolor": "white",
    "markeredgewidth": 0.4,
}
"""How single seeds are drawn on a bar: the white edge keeps them visible on bars of every colour, black ones too."""

SETTINGS = {
    "font.size": 7,
    "axes.titlesize": 8,
    "axes.labelsize": 7,
    "legend.fontsize": 7,
    "xtick.labelsize": 6,
    "ytick.labelsize": 6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.5,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "savefig.dpi": 250,
    "figure.dpi": 250,
    "pdf.fonttype": 42,
}
"""Matplotlib settings of all figures; font type 42 keeps the text of a PDF searchable."""


def in_order(methods: Iterable[str]) -> list[str]:
    """Return the methods in the order of listings, unknown ones by name; compared results last."""
    present = set(methods)
    ranks = {name: rank for rank, name in enumerate(in_listed_order("methods", {method_of(name) for name in present}))}
    return sorted(present, key=lambda name: (is_compared(name), ranks[method_of(name)], name))


def line_styles(methods: Iterable[str]) -> dict[str, tuple[str, Dashes]]:
    """Return (colour, dashes) for each method; those of the paper's five do not depend on other methods.

    Compared results have their method's colour and are dashed.
    """
    styles: dict[str, tuple[str, Dashes]] = {}
    others = 0
    present = set(methods)
    for name in in_order(method_of(name) for name in present):
        if name in COLOURS:
            styles[name] = (COLOURS[name], DASHES[0])
        else:
            turn, index = divmod(others, len(OTHER_COLOURS))
            styles[name] = (OTHER_COLOURS[index], DASHES[turn % len(DASHES)])
            others += 1
    return {name: (styles[method_of(name)][0], "--") if is_compared(name) else styles[name] for name in present}


@contextmanager
def style() -> Iterator[None]:
    """Draw with the settings of this module instead of the user's."""
    settings: dict[Any, Any] = {**mpl.rcParamsDefault, **SETTINGS, "backend": "Agg"}
    with mpl.rc_context(settings):
        yield


def draw_table(axes: Axes, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Fill `axes` with a table of texts, with column widths that fit the texts."""
    axes.axis("off")
    table = axes.table(rows, colLabels=header, loc="center", edges="horizontal", cellLoc="right")
    table.auto_set_font_size(False)
    table.set_fontsize(6)
    table.auto_set_column_width(list(range(len(header))))
