"""Draw figures from results, and save each as picture, vector graphic and table."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pandas as pd

from codesign_bench.errors import UserError
from codesign_bench.figures.comparison import with_compared
from codesign_bench.registry import load_module, names
from codesign_bench.storage.files import write_bytes
from codesign_bench.storage.results import find_cells, load_evaluations, load_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVES = "curves"
"""What a figure is drawn from unless its module names another `SOURCE`."""


def _curves(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    del say, wanted  # curves come from `run` alone
    return load_results(results)


def _sensitivity(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.evaluation.sensitivity import load_or_measure

    return load_or_measure(results, say, measure_missing=wanted)


def _evaluations(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    del say, wanted
    return load_evaluations(results)


def _designed_tools(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.figures.designed_tools import designed_tools

    del wanted
    return designed_tools(results, say)


def _generalization(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.figures.generalization import outcomes_by_region

    return outcomes_by_region(results, say, measure=wanted)


def _hyperparameters(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    """Return the settings of the methods that stand in the paper's order, on the paper's tasks."""
    from codesign_bench.studies.corl2023.hyperparameters import hyperparameters
    from codesign_bench.studies.corl2023.scenes import SCENES

    del say
    methods = import_module("codesign_bench.methods").ORDER
    return hyperparameters(methods, [name for name in SCENES if wanted or name in _tasks_of(results)])


def _tasks_at_work(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.figures.task_pictures import tasks_at_work
    from codesign_bench.task import task_names

    return tasks_at_work(task_names() if wanted else _tasks_of(results), say)


def _tasks_of(results: Path) -> list[str]:
    """Return the tasks that results tell of: what needs no results is drawn for these, unless it is asked for by name.

    Raises:
        UserError: there is none.
    """
    found = list(dict.fromkeys(str(content["task"]) for _, content in find_cells(results)))
    if not found:
        raise UserError(f"no cells in '{results}' yet; name the figure to have it all the same")
    return found


def _timing(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.evaluation.timing import timing_frame

    del say, wanted
    return timing_frame(results)


def _baseline_sweep(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.studies.corl2023.baseline_sweep import load_sweep

    del say, wanted  # sweeps come from `reproduce` alone
    return load_sweep(results)


def _deployment(results: Path, say: Callable[[str], None], wanted: bool) -> pd.DataFrame:
    from codesign_bench.deployment.tables import load_deployment

    del say, wanted  # trials come from `deploy` alone
    return load_deployment(results)


SOURCES: Mapping[str, Callable[[Path, Callable[[str], None], bool], pd.DataFrame]] = {
    CURVES: _curves,
    "baseline_sweep": _baseline_sweep,
    "deployment": _deployment,
    "design_sensitivity": _sensitivity,
    "designed_tools": _designed_tools,
    "evaluations": _evaluations,
    "generalization": _generalization,
    "hyperparameters": _hyperparameters,
    "tasks_at_work": _tasks_at_work,
    "timing": _timing,
}
"""Sources of figures: name -> function of results folder, a function that tells the user a line, and whether the
figure was asked for by name, so that what is missing may be measured."""


@dataclass(frozen=True)
class Drawing:
    """A figure drawn from results; where it goes is the caller's affair."""

    name: str
    title: str
    about: str
    """What it shows: the first paragraph of its module."""
    table: pd.DataFrame
    """The numbers that it shows."""
    figure: Figure
    texts: Mapping[str, str]
    """Further files by their ending."""


def draw_figures(
    wanted: Sequence[str], results: Path, out: Path, say: Callable[[str], None], compare: Path | None = None
) -> None:
    """Draw `wanted`, or every figure that the results allow, and tell the paths; the first figure's picture comes last.

    Args:
        wanted: names of figures; none: all.
        results: where cells lie.
        out: where figures go.
        say: is told every path, and what is left out.
        compare: further results, whose curves figures with `COMPARES` show besides.

    Raises:
        UserError: an unknown figure, a folder that cannot be written, or nothing that can be drawn.
    """
    modules = {name: load_module("paper_figs", name) for name in wanted or names("paper_figs")}
    comparing = [name for name, module in modules.items() if getattr(module, "COMPARES", False)]
    if compare is not None and not comparing:
        choices = [name for name in names("paper_figs") if getattr(load_module("paper_figs", name), "COMPARES", False)]
        raise UserError(f"--compare: {', '.join(wanted)} show no curves; choose from: {', '.join(choices)}")
    if not wanted and not results.is_dir():
        raise UserError(f"no results folder '{results}'; make one with: codesign-bench run --out {results}")
    if compare is not None:
        load_results(compare)  # a wrong folder is an error, not a reason to leave the curves out
    make_folder(out)
    drawn: list[Path] = []
    for drawing in _drawings(modules, results, say, bool(wanted), compare):
        drawn = [*save(drawing, out), *drawn]  # what comes first is told last
    if not drawn:
        raise UserError(f"the results in '{results}' allow no figure yet")
    for path in sorted(drawn, key=lambda path: path.suffix == ".png"):
        say(str(path))


def possible_drawings(results: Path, say: Callable[[str], None]) -> Iterator[Drawing]:
    """Yield every figure that the results allow; `say` is told which are left out, and why."""
    modules = {name: load_module("paper_figs", name) for name in names("paper_figs")}
    return _drawings(modules, results, say, wanted=False)


def save(drawing: Drawing, out: Path) -> list[Path]:
    """Write numbers, vector graphic, picture and texts of `drawing` into `out` and return their paths."""
    paths = [out / f"{drawing.name}.csv", out / f"{drawing.name}.pdf", out / f"{drawing.name}.png"]
    write_bytes(paths[0], csv_bytes(drawing.table))
    for path in paths[1:]:
        undated = {"CreationDate": None} if path.suffix == ".pdf" else None  # the same results give the same file
        drawing.figure.savefig(path, metadata=undated)
    for ending, text in drawing.texts.items():
        paths.insert(0, out / f"{drawing.name}.{ending}")
        write_bytes(paths[0], text.encode())
    return paths


def csv_bytes(table: pd.DataFrame) -> bytes:
    """Return a figure's numbers as the content of a CSV file."""
    return table.to_csv(index=False, lineterminator="\n").encode()


def _drawings(
    modules: Mapping[str, ModuleType],
    results: Path,
    say: Callable[[str], None],
    wanted: bool,
    compare: Path | None = None,
) -> Iterator[Drawing]:
    """Yield the figures of `modules` one by one, and forget each before the next.

    Raises:
        UserError: the results lack something that a figure `wanted` by name needs.
    """
    frames: dict[str, pd.DataFrame] = {}
    for name, module in modules.items():
        source = getattr(module, "SOURCE", CURVES)
        try:
            if source not in frames:
                frames[source] = SOURCES[source](results, say, wanted)
            frame = frames[source]
            if compare is not None and getattr(module, "COMPARES", False):
                frame = with_compared(frame, compare)
            drawing = _draw(name, module, frame)
        except UserError as error:
            if wanted:
                raise
            say(f"{name} left out: {error}")
            continue
        yield drawing
        _close(drawing.figure)


def _draw(name: str, module: Any, frame: pd.DataFrame) -> Drawing:
    """Return the figure that a module of figures draws from `frame`.

    Raises:
        UserError: the results lack something that it needs.
    """
    import matplotlib

    matplotlib.use("Agg")
    return Drawing(
        name=name,
        title=module.TITLE,
        about=" ".join((inspect.getdoc(module) or "").split("\n\n")[0].split()),
        table=module.data(frame),
        figure=module.draw(frame),
        texts=module.texts(frame) if hasattr(module, "texts") else {},
    )


def _close(figure: Figure) -> None:
    """Free a figure that was made through pyplot, which else keeps it for good."""
    import matplotlib.pyplot as plt

    plt.close(figure)


def make_folder(out: Path) -> None:
    """Make the folder `out`.

    Raises:
        UserError: it cannot be written to.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_bytes(out / ".writable", b"")
        (out / ".writable").unlink()
    except OSError as error:
        raise UserError(f"--out {out}: cannot write there ({error.strerror})") from error
