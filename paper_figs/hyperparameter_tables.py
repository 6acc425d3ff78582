"""What runs beside what the paper's tables of hyperparameters print; differences are marked.

Scenes are as the tasks define them, methods as the profiles `paper` and `laptop` resolve them. The paper has one table
per task for its scene and its own method, and one for the baselines. Our text files have the same, with the scene in a
separate table; the picture has the rows of the paper's six tables.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from itertools import accumulate

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from codesign_bench.storage.frames import require_columns
from codesign_bench.studies.corl2023.hyperparameters import hyperparameters_of_results
from codesign_bench.studies.corl2023.learners import LearnerTable
from codesign_bench.text_tables import latex, markdown

from ._order import task_order
from ._style import PAGE_WIDTH, in_order, style

TITLE = "Hyperparameters"
SOURCE = hyperparameters_of_results
PROFILES = ("paper", "laptop")
OF_PROFILES = (f"{profile}{ending}" for ending in ("", "_source", "_differs") for profile in PROFILES)
NEEDED = ("task", "method", "label", "name", "printed_value", *OF_PROFILES)
SCENE, OWN = "scene", "gnn_ppo"
"""In the column `method`: the scene, and the paper's own method."""
LEARNER_ROWS = tuple(field.name for field in fields(LearnerTable))
"""Rows of the paper's tables on its own method, in its order."""

PRINTED: Mapping[str, str] = {
    "control_log_std": "Control Log Std.",
    "design_log_std": "Design Log Std.",
    "fix_std": "Fix Design & Control Std.",
    "entropy_weight": "Entropy Weight",
    "kl_threshold": "KL Divergence Threshold",
    "epochs": "PPO Steps Per Batch",
    "tool_position_init": "Tool Position Init.",
    "tool_length_init": "Tool Length Init.",
    "tool_angle_init": "Tool Angle Init.",
    "popsize": "Population Size",
    "sigma0": "Initial Stdev",
}
"""Names printed in the paper, if they differ from the field's name."""
ABBREVIATIONS = ("gae", "gnn", "kl", "mlp", "ppo")

ROW_HEIGHT = 0.125
"""Height of a line of text in the picture, in inches."""
FONT_SIZE = 4.8
NAME_SHARE = 0.17
"""Width of the column of names, as a fraction of the picture."""
WRAPPED_FROM = 24
"""Longer texts are broken into two lines."""
ABSENT = "-"
DIFFERENT = "{used} (paper: {printed})"
"""What the picture shows where the value in use is not the printed one."""


def data(frame: pd.DataFrame) -> pd.DataFrame:
    """Return every number of every scene and every hyperparameter of every method on every task under both profiles.

    Args:
        frame: columns `NEEDED`: one row per task, method and hyperparameter.

    Returns:
        The same rows, the tasks in the paper's order, with `printed`, the name that the tables print.

    Raises:
        UserError: a column is missing, or there is no row.
    """
    require_columns(frame, NEEDED, "the settings")
    rank = {name: position for position, name in enumerate(task_order(frame["task"]))}
    ordered = frame.sort_values("task", key=lambda tasks: tasks.map(rank), kind="stable")
    return ordered.assign(printed=[_printed(name) for name in ordered["name"]]).reset_index(drop=True)


def draw(frame: pd.DataFrame) -> Figure:
    """Return the paper's rows as a picture: the scene, then the paper's own method under each profile, over the tasks.

    A scene's value that is not the printed one is followed by the printed one.

    Raises:
        UserError: as `data` does.
    """
    table = data(frame)
    learner = table[(table["method"] == OWN) & table["name"].isin(LEARNER_ROWS)]
    parts = {"scene, in every profile": _over_tasks(_with_printed(table[table["method"] == SCENE]), PROFILES[0])}
    for profile in PROFILES:
        parts[f"{OWN}, profile {profile}"] = _over_tasks(learner, profile)
    parts = {title: part for title, part in parts.items() if len(part)}
    lines = [2 + sum(_lines(part.loc[name]) for name in part.index) for part in parts.values()]
    with style():
        figure = Figure(figsize=(PAGE_WIDTH, ROW_HEIGHT * (sum(lines) + len(lines))))
        bottoms = accumulate(count + 1 for count in lines)
        for (title, part), count, bottom in zip(parts.items(), lines, bottoms, strict=True):
            total = sum(lines) + len(lines)
            axes = figure.add_axes((0.01, 1.0 - bottom / total + 0.5 / total, 0.98, count / total))
            _draw_table(axes, title, part)
        figure.draw_without_rendering()
    return figure


def texts(frame: pd.DataFrame) -> dict[str, str]:
    """Return all tables as text by file ending: Markdown and LaTeX.

    Raises:
        UserError: as `data` does.
    """
    tables = _tables(data(frame))
    pages = [f"## {title}\n\n{markdown(header, rows)}" for title, header, rows in tables]
    tabulars = [f"% {title}\n{latex(header, rows)}" for title, header, rows in tables]
    return {"md": "# Hyperparameters\n\n" + "\n".join(pages), "tex": "\n".join(tabulars)}


def _printed(name: str) -> str:
    words = [word.upper() if word in ABBREVIATIONS else word.title() for word in name.split("_")]
    return PRINTED.get(name, " ".join(words))


def _place(name: str) -> int:
    """Return the position of a row in the paper's tables; other rows come last."""
    return LEARNER_ROWS.index(name) if name in LEARNER_ROWS else len(LEARNER_ROWS)


def _with_printed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows in which each value that is not the printed one is followed by it."""

    def shown(row: pd.Series) -> str:
        used, printed = str(row[PROFILES[0]]), str(row["printed_value"])
        if not row[f"{PROFILES[0]}_differs"]:
            return used
        text = DIFFERENT.format(used=used, printed=printed)
        return text if len(text) < WRAPPED_FROM else text.replace(" (paper", "\n(paper")

    return rows.assign(**{PROFILES[0]: [shown(row) for _, row in rows.iterrows()]})


def _tables(table: pd.DataFrame) -> list[tuple[str, list[str], list[list[str]]]]:
    """Return title, header and rows of every table: two per task, of its scene and of the paper's method, one per other
    method.
    """
    result = []
    sources, scene_columns = [f"{profile}_source" for profile in PROFILES], [PROFILES[0], f"{PROFILES[0]}_differs"]
    for task in dict.fromkeys(table["task"]):
        of_task, name = table[table["task"] == task], str(task).replace("_", " ")
        scene = of_task[of_task["method"] == SCENE]
        if len(scene):
            columns = ["printed", "printed_value", *scene_columns, sources[0]]
            header = ["scene", "paper", "ours", "", "source of ours"]
            result.append((f"{name}: scene, in every profile", header, scene[columns].values.tolist()))
        own = of_task[of_task["method"] == OWN].sort_values("name", key=lambda names: names.map(_place), kind="stable")
        if len(own):
            columns = ["printed", PROFILES[0], PROFILES[1], f"{PROFILES[1]}_differs", *sources]
            header = ["hyperparameter", *PROFILES, "", *(f"source ({profile})" for profile in PROFILES)]
            result.append((f"{name}: {OWN}", header, own[columns].values.tolist()))
    for method in in_order(set(table["method"]) - {SCENE, OWN}):
        own = table[table["method"] == method]
        rows = [
            [_printed(name), *(_common(own[own["name"] == name], profile) for profile in PROFILES)]
            for name in dict.fromkeys(own["name"])
        ]
        result.append((f"{method}, on all tasks", ["hyperparameter", *PROFILES], rows))
    return result


def _common(rows: pd.DataFrame, profile: str) -> str:
    """Return the value of one hyperparameter on most tasks, and the tasks with a different value."""
    values = dict(zip(rows["task"], rows[profile], strict=True))
    ((usual, _), *_) = Counter(values.values()).most_common()
    others = [f"{task.replace('_', ' ')}: {value}" for task, value in values.items() if value != usual]
    return f"{usual} ({', '.join(others)})" if others else usual


def _over_tasks(rows: pd.DataFrame, profile: str) -> pd.DataFrame:
    """Return a table of texts with a row per hyperparameter, in the paper's order, and a column per task."""
    wide = rows.pivot(index="name", columns="task", values=profile).fillna(ABSENT)
    names = dict.fromkeys(rows["name"])
    order = [name for name in LEARNER_ROWS if name in names] or list(names)
    return wide.loc[order, list(dict.fromkeys(rows["task"]))].map(_wrapped)


def _wrapped(text: str) -> str:
    """Break long lists of numbers in the middle."""
    return "\n".join(_broken(line) for line in text.split("\n"))


def _broken(line: str) -> str:
    parts = line.split(", ")
    if len(line) < WRAPPED_FROM or len(parts) < 2:
        return line
    half = (len(parts) + 1) // 2
    return ", ".join(parts[:half]) + ",\n" + ", ".join(parts[half:])


def _lines(row: pd.Series) -> int:
    return max(1 + str(text).count("\n") for text in row)


def _draw_table(axes: Axes, title: str, part: pd.DataFrame) -> None:
    """Draw texts with one column per task, with row heights that fit the texts."""
    axes.axis("off")
    axes.grid(visible=False)
    tasks = [str(task).replace("_", " ") for task in part.columns]
    cells = [[_printed(str(name)), *part.loc[name]] for name in part.index]
    widths = [NAME_SHARE, *[(1.0 - NAME_SHARE) / len(tasks)] * len(tasks)]
    drawn = axes.table(
        cells, colLabels=[title, *tasks], colWidths=widths, bbox=Bbox.unit(), edges="horizontal", cellLoc="center"
    )
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(FONT_SIZE)
    lines = [1.5, *(_lines(part.loc[name]) for name in part.index)]
    for (row, column), cell in drawn.get_celld().items():
        cell.set_height(lines[row] / sum(lines))
        cell.set_linewidth(0.3)
        if column == 0:
            cell.set_text_props(ha="left")
            cell.PAD = 0.01
        if row == 0:
            cell.set_text_props(weight="bold")
