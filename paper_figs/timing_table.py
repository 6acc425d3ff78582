"""Training and inference times of the methods, with the paper's (its table in "Computational Resources").

Training times are extrapolated to the paper's 10^7 steps from the times of the cells as they ran, in parallel with
others and on any machine. Inference is one call of the policy on one observation, measured when the figure is drawn.
"""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from codesign_bench.figures.source import timing
from codesign_bench.storage.frames import require_columns
from codesign_bench.studies.corl2023.protocol import PROTOCOL, TIMINGS
from codesign_bench.text_tables import latex, markdown

from ._order import task_order
from ._style import PAGE_WIDTH, draw_table, in_order, style

TITLE = "Training and inference time"
SOURCE = timing
NEEDS = "codesign-bench run --method all --task T"
NEEDED = ("task", "method", "label", "seed", "profile", "env_steps", "train_s", "cores", "cpu", "inference_s")
PAPER_TASK = "fetch_cube"
"""The task of the paper's table."""
ROW_HEIGHT = 0.2
"""In inches."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return one row per task and method.

    Args:
        frame: one row per finished cell, with the columns `NEEDED`.

    Returns:
        Columns task, method, label, profile, cells, steps_per_second (median over cells), training_minutes (for 10^7
        steps), inference_ms, cores, cpu, paper_training_minutes, paper_inference_ms (NaN where the paper gives none).

    Raises:
        UserError: a column is missing, or there is no row.
    """
    require_columns(frame, NEEDED, "the records")
    return pd.DataFrame([_row(frame, task, method) for task, method in _pairs(frame)])


def draw(frame: pd.DataFrame) -> Figure:
    """Return the table as a picture.

    Raises:
        UserError: as `data` does.
    """
    header, rows = _cells(data(frame))
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, ROW_HEIGHT * (len(rows) + 3)), layout="constrained")
        axes = figure.subplots()
        draw_table(axes, header, rows)
        axes.set_title(TITLE)
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return the table as text by file ending: Markdown and LaTeX.

    Raises:
        UserError: as `data` does.
    """
    header, rows = _cells(data(frame))
    return {"md": markdown(header, rows), "tex": latex(header, rows)}


def _pairs(frame: pd.DataFrame) -> list[tuple[str, str]]:
    tasks = task_order(frame["task"])
    return [(task, method) for task in tasks for method in in_order(frame.loc[frame["task"] == task, "method"])]


def _row(frame: pd.DataFrame, task: str, method: str) -> dict[str, object]:
    cells = frame[(frame["task"] == task) & (frame["method"] == method)]
    speed = float((cells["env_steps"] / cells["train_s"]).median())
    paper = TIMINGS.get(method) if task == PAPER_TASK else None
    inference = paper.inference_seconds if paper else None
    return {
        "task": task,
        "method": method,
        "label": cells["label"].iloc[0],
        "profile": ", ".join(sorted(set(cells["profile"]))),
        "cells": len(cells),
        "steps_per_second": speed,
        "training_minutes": PROTOCOL.total_steps / speed / 60.0 if speed > 0.0 else float("inf"),
        "inference_ms": 1e3 * float(cells["inference_s"].median()),
        "cores": int(cells["cores"].max()),
        "cpu": " / ".join(sorted(set(cells["cpu"]))),
        "paper_training_minutes": paper.training_minutes if paper else float("nan"),
        "paper_inference_ms": 1e3 * inference if inference else float("nan"),
    }


def _cells(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of text."""
    header = [
        "task",
        "method",
        "profile",
        "cells",
        "cores",
        "steps/s",
        "min for 10^7",
        "ms per call",
        "paper: min",
        "paper: ms",
    ]
    rows = [
        [
            str(row["task"]).replace("_", " "),
            str(row["label"]),
            str(row["profile"]),
            str(row["cells"]),
            str(row["cores"]),
            f"{row['steps_per_second']:,.0f}",
            f"{row['training_minutes']:,.0f}",
            f"{row['inference_ms']:.3f}",
            _or_dash(row["paper_training_minutes"], "{:,.0f}"),
            _or_dash(row["paper_inference_ms"], "{:.3f}"),
        ]
        for row in table.to_dict("records")
    ]
    return header, rows


def _or_dash(value: float, form: str) -> str:
    return "-" if pd.isna(value) else form.format(value)
