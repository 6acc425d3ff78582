"""Draw figures from results and save each as picture, vector graphic and table.

A figure is a module with `TITLE`, `data(frame)`, which returns the numbers shown, and `draw(frame)`, which returns a
matplotlib figure. It may also have `SOURCE`, a function of a `Request` that returns its frame (default: learning
curves), `NEEDS`, the command that makes what it shows, `texts(frame)`, further files by their ending, and
`COMPARES = True` if `plot --compare` may overlay the curves of other results.
"""

from __future__ import annotations

import inspect
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pandas as pd

from codesign_bench.console import Log, silent
from codesign_bench.errors import UserError, in_one_line
from codesign_bench.figures.comparison import made_otherwise, with_compared
from codesign_bench.figures.source import Request, Source, curves
from codesign_bench.registry import built_in, load_all, load_module, names, usable_modules
from codesign_bench.storage.files import Outputs, make_folder, removed_if_refused
from codesign_bench.storage.frames import stored_curves
from codesign_bench.storage.layout import first_run
from codesign_bench.storage.tables import csv_bytes
from codesign_bench.study.study import DEFAULT_STUDY, Study, load_study
from codesign_bench.visible_text import in_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Drawing:
    """A figure drawn from results, not yet saved."""

    name: str
    title: str
    about: str
    """Description: the first paragraph of its module."""
    table: pd.DataFrame
    """The numbers shown."""
    figure: Figure
    texts: Mapping[str, str]
    """Further files by their ending."""


def draw_figures(
    wanted: Sequence[str],
    results: Path,
    out: Path,
    log: Log,
    compare: Path | None = None,
    study: Study | None = None,
) -> None:
    """Draw `wanted`, or every figure that can be drawn, and log the paths; the first figure's picture comes last.

    Args:
        wanted: names of figures; none: those of `study`.
        results: folder of the cells.
        out: folder of the figures.
        log: prints every path, what is left out, and differences in how compared cells were made.
        compare: other results, whose curves are overlaid in figures with `COMPARES`.
        study: without names, its figures are drawn and those that belong to no study; with names, they show its tasks,
            too, although there are no cells of theirs; None: the default study.

    Raises:
        UserError: an unknown figure, a folder that is not writable, or no figure can be drawn.
    """
    chosen = load_study(DEFAULT_STUDY) if study is None else study
    request = Request(results, log, named=bool(wanted), tasks=chosen.tasks or names("tasks"))
    modules = _modules(wanted or figure_names(study, log), request)
    if compare is not None and not any(getattr(module, "COMPARES", False) for module in modules.values()):
        known = _modules(usable_modules("paper_figs"), Request(results, silent))
        choices = [name for name, module in known.items() if getattr(module, "COMPARES", False)]
        raise UserError(f"--compare: {', '.join(wanted)} show no curves; choose from: {', '.join(choices)}")
    if not wanted and not results.is_dir():
        raise UserError(f"no results folder '{results}'; create one with: {first_run(results)}")
    if compare is not None:
        stored_curves(compare)  # a wrong folder is an error, not a reason to leave the curves out
    drawn: list[Path] = []
    with removed_if_refused(out):
        make_folder(f"--out {out}", out)
        for drawing in _drawings(modules, request, compare):
            drawn = [*save(drawing, out), *drawn]  # the first figure is logged last
        if not drawn:
            raise UserError(f"nothing in '{results}' can be plotted yet")
    for line in made_otherwise(results, compare) if compare is not None else ():
        log(line)
    for path in sorted(drawn, key=lambda path: path.suffix == ".png"):
        log(str(path))


def figure_names(study: Study | None, log: Log = silent) -> list[str]:
    """Return the figures of a study (None: the default one), and those that belong to no study.

    `log` names those that cannot be imported in this Python, and why.
    """
    chosen = load_study(DEFAULT_STUDY) if study is None else study
    others = [other for name, other in load_all("studies", "STUDY") if name != chosen.name]
    of_others = {name for other in others for name in other.figures}
    return [name for name in usable_modules("paper_figs", log) if name in chosen.figures or name not in of_others]


def possible_drawings(results: Path, log: Log, study: Study | None = None) -> Iterator[Drawing]:
    """Yield every figure of a study that can be drawn; `log` gets those that are left out, and why."""
    request = Request(results, log)
    return _drawings(_modules(figure_names(study, log), request), request)


def save(drawing: Drawing, out: Path) -> list[Path]:
    """Write numbers, vector graphic, picture and texts of `drawing` to `out`, all of them or none; return their paths.

    Raises:
        UserError: a file cannot be written; the earlier files are as they were.
    """
    files: dict[str, bytes | str] = dict(reversed(list(drawing.texts.items())))
    files["csv"] = csv_bytes(drawing.table)
    for ending in ("pdf", "png"):
        files[ending] = _picture(drawing.figure, ending)
    with Outputs(f"--out {out}") as outputs:
        for ending, content in files.items():
            outputs.write(out / f"{drawing.name}.{ending}", content)
    return [out / f"{drawing.name}.{ending}" for ending in files]


def _picture(figure: Figure, ending: str) -> bytes:
    """Return a figure as the content of a file."""
    stream = io.BytesIO()
    undated = {"CreationDate": None} if ending == "pdf" else None  # the same results give the same file
    figure.savefig(stream, format=ending, metadata=undated)
    return stream.getvalue()


def _modules(wanted: Iterable[str], request: Request) -> dict[str, ModuleType]:
    """Return the modules of figures; those of other packages that cannot be imported are left out and named.

    Raises:
        UserError: a figure that was requested by name is unknown, or cannot be imported.
    """
    modules = {}
    for name in wanted:
        try:
            modules[name] = load_module("paper_figs", name)
            _check_module(name, modules[name])
        except (UserError, TypeError) as error:
            modules.pop(name, None)
            if request.named or name in built_in("paper_figs"):
                raise
            request.log(f"{name} left out: {error}")
    return modules


def _check_module(name: str, module: ModuleType) -> None:
    """Check that a module has what a figure must have.

    Raises:
        TypeError: it has not.
    """
    lacking = [part for part in ("TITLE", "data", "draw") if not hasattr(module, part)]
    if lacking:
        raise TypeError(f"{module.__name__} is registered as the figure '{name}' and must define {', '.join(lacking)}")


def _drawings(modules: Mapping[str, ModuleType], request: Request, compare: Path | None = None) -> Iterator[Drawing]:
    """Yield the figures of `modules` one by one, and free each before the next.

    Raises:
        UserError: data of a figure that was requested by name are missing.
    """
    frames: dict[Source, pd.DataFrame] = {}
    for name, module in modules.items():
        source: Source = getattr(module, "SOURCE", curves)
        try:
            if source not in frames:
                frames[source] = source(request)
            frame = frames[source]
            if compare is not None and getattr(module, "COMPARES", False):
                frame = with_compared(frame, compare)
            drawing = _draw(name, module, frame)
            if name not in built_in("paper_figs"):
                _check_drawing(drawing)
        except UserError as error:
            needs = f"; needs: {module.NEEDS}" if hasattr(module, "NEEDS") else ""
            if request.named:
                raise UserError(f"{name}: {error}{needs}") from error
            request.log(f"{name} left out: {error}{needs}")
            continue
        except (Exception, SystemExit) as error:  # of code that is not ours
            if request.named or name in built_in("paper_figs"):
                raise
            request.log(f"{name} left out, for it has a fault: {in_one_line(error)}")
            continue
        yield drawing
        _close(drawing.figure)


def _draw(name: str, module: Any, frame: pd.DataFrame) -> Drawing:
    """Return the figure of a module, drawn from `frame`.

    Raises:
        UserError: data are missing.
    """
    import matplotlib

    matplotlib.use("Agg")
    return Drawing(
        name=name,
        title=module.TITLE,
        about=" ".join((inspect.getdoc(module) or "").split("\n\n")[0].split()),
        table=module.data(frame),
        figure=module.draw(_as_drawn(frame)),
        texts=module.texts(frame) if hasattr(module, "texts") else {},
    )


def _as_drawn(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the frame with its texts as matplotlib should show them, for they come from results."""
    names = [name for name in frame.columns if not pd.api.types.is_numeric_dtype(frame[name])]
    shown = {
        name: frame[name].map(lambda value: in_figure(value) if isinstance(value, str) else value) for name in names
    }
    return frame.assign(**shown)


def _check_drawing(drawing: Drawing) -> None:
    """Save a drawing to nowhere, so that what is wrong with it shows while it can still be left out."""
    csv_bytes(drawing.table)
    drawing.figure.savefig(io.BytesIO(), format="png")
    for text in drawing.texts.values():
        text.encode()


def _close(figure: Figure) -> None:
    """Free a figure that was made through pyplot, which would otherwise keep it."""
    import matplotlib.pyplot as plt

    plt.close(figure)
