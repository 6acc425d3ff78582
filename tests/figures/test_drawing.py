"""Figures are drawn as asked, saved as picture, vector graphic, table and texts, and what is missing is told."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd
import pytest
from matplotlib.figure import Figure

from builders import rising, store_cell
from codesign_bench import registry
from codesign_bench.errors import UserError
from codesign_bench.figures.drawing import draw_figures, figure_names, possible_drawings, save
from codesign_bench.figures.source import Request
from codesign_bench.registry import names
from codesign_bench.study import Study
from codesign_bench.study.experiment import Experiment

AddFigure = Callable[..., ModuleType]


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a folder with the curve of one cell."""
    store_cell(tmp_path / "runs", curve=rising(1.0, 2.0))
    return tmp_path / "runs"


@pytest.fixture
def add_figure(toy: None) -> AddFigure:
    """Return a function that registers a figure of two numbers; keywords are further names of its module."""

    def add(name: str, **more: Any) -> ModuleType:
        module = ModuleType(name, "What it shows,\nin a paragraph.\n\nMore about it.")
        parts: dict[str, Any] = {
            "TITLE": name.title(),
            "SOURCE": lambda request: pd.DataFrame({"x": [1, 2]}),
            "data": lambda frame: frame.assign(y=2 * frame["x"]),
            "draw": lambda frame: Figure(figsize=(1.0, 1.0)),
            **more,
        }
        vars(module).update({key: value for key, value in parts.items() if value is not None})
        registry.register("paper_figs", name, lambda: module)
        return module

    return add


def lacking(request: Request) -> pd.DataFrame:
    """Lack data."""
    raise UserError("nothing measured")


def test_a_figure_is_saved_as_table_vector_graphic_and_picture(
    add_figure: AddFigure, results: Path, tmp_path: Path
) -> None:
    add_figure("mine", texts=lambda frame: {"tex": r"\\hline"})
    told: list[str] = []
    draw_figures(["mine"], results, tmp_path / "out", told.append)
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"mine.csv", "mine.pdf", "mine.png", "mine.tex"}
    assert set(told) == {str(tmp_path / "out" / name) for name in written}
    assert (tmp_path / "out" / "mine.csv").read_text() == "x,y\n1,2\n2,4\n"
    assert (tmp_path / "out" / "mine.tex").read_text() == r"\\hline"


def test_the_picture_of_what_was_asked_for_first_is_told_last(
    add_figure: AddFigure, results: Path, tmp_path: Path
) -> None:
    told: list[str] = []
    for name in ("first", "second"):
        add_figure(name)
    draw_figures(["first", "second"], results, tmp_path / "out", told.append)
    assert [Path(line).name for line in told[-2:]] == ["second.png", "first.png"]


def test_curves_are_drawn_where_a_figure_names_no_source(add_figure: AddFigure, results: Path, tmp_path: Path) -> None:
    add_figure("mine", SOURCE=None, data=lambda frame: frame[["env_steps", "return_mean"]])
    draw_figures(["mine"], results, tmp_path, print)
    assert (tmp_path / "mine.csv").read_text() == "env_steps,return_mean\n0,1.0\n100,2.0\n"


def test_a_source_is_asked_once_for_all_figures(add_figure: AddFigure, results: Path, tmp_path: Path) -> None:
    asked: list[bool] = []

    def source(request: Request) -> pd.DataFrame:
        asked.append(request.named)
        return pd.DataFrame({"x": [1]})

    for name in ("first", "second"):
        add_figure(name, SOURCE=source)
    draw_figures(["first", "second"], results, tmp_path, print)
    assert asked == [True]


def test_what_a_named_figure_lacks_is_an_error_with_the_command_that_makes_it(
    add_figure: AddFigure, results: Path, tmp_path: Path
) -> None:
    add_figure("mine", SOURCE=lacking, NEEDS="codesign-bench bench")
    with pytest.raises(UserError, match="mine: nothing measured; needs: codesign-bench bench"):
        draw_figures(["mine"], results, tmp_path, print)


def test_what_another_figure_lacks_is_told_and_the_rest_is_drawn(add_figure: AddFigure, results: Path) -> None:
    add_figure("mine")
    add_figure("other", SOURCE=lacking, NEEDS="codesign-bench bench")
    told: list[str] = []
    study = Study(name="small", title="Small", question="Is it so?")
    found = {drawing.name: drawing for drawing in possible_drawings(results, told.append, study)}
    assert "other left out: nothing measured; needs: codesign-bench bench" in told
    assert (found["mine"].title, found["mine"].about) == ("Mine", "What it shows, in a paragraph.")
    assert found["mine"].table["y"].tolist() == [2, 4]
    assert "other" not in found


def test_a_study_has_its_own_figures_and_those_that_belong_to_none(add_figure: AddFigure) -> None:
    for name in ("of_nobody", "of_mine", "of_another"):
        add_figure(name)
    mine, another = (
        Study(name=name, title=name, question="?", experiments={"one": Experiment((figure,), "ours", ())})
        for name, figure in (("mine", "of_mine"), ("another", "of_another"))
    )
    for study in (mine, another):
        module = ModuleType(study.name)
        module.STUDY = study  # type: ignore[attr-defined]
        registry.register("studies", study.name, lambda module=module: module)  # type: ignore[misc]
    assert {"of_nobody", "of_mine"} <= set(figure_names(mine))
    assert "of_another" not in figure_names(mine)
    assert "of_nobody" in figure_names(None)
    assert not {"of_mine", "of_another"} & set(figure_names(None))
    assert figure_names(None) == [name for name in names("paper_figs") if name in figure_names(None)]


def test_the_same_figure_is_the_same_file(add_figure: AddFigure, results: Path, tmp_path: Path) -> None:
    add_figure("mine")
    for out in ("one", "two"):
        draw_figures(["mine"], results, tmp_path / out, print)
    for ending in ("pdf", "png", "csv"):
        assert (tmp_path / "one" / f"mine.{ending}").read_bytes() == (tmp_path / "two" / f"mine.{ending}").read_bytes()


def test_saving_returns_the_paths_with_the_picture_last(add_figure: AddFigure, results: Path, tmp_path: Path) -> None:
    add_figure("mine", texts=lambda frame: {"md": "| x |"})
    study = Study(name="small", title="Small", question="Is it so?")
    (drawing,) = [found for found in possible_drawings(results, print, study) if found.name == "mine"]
    assert [path.suffix for path in save(drawing, tmp_path)] == [".md", ".csv", ".pdf", ".png"]


@pytest.mark.parametrize("label", [r"$\frac{1$", r"$\nonsense$", "costs $5 or $6", "x" * 10_000, "\x1b[2J\x00"])
def test_text_of_results_is_never_a_formula(tmp_path: Path, label: str) -> None:
    store_cell(tmp_path / "runs", curve=rising(1.0, 2.0), label=label[:500])
    draw_figures(["learning_curves", "final_results"], tmp_path / "runs", tmp_path / "out", print)
    assert (tmp_path / "out" / "learning_curves.png").stat().st_size > 0


def test_a_figure_that_cannot_be_written_leaves_the_earlier_one_whole(
    add_figure: AddFigure, results: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    add_figure("mine")
    draw_figures(["mine"], results, out, print)
    before = {path.name: path.read_bytes() for path in out.iterdir() if path.suffix != ".pdf"}
    (out / "mine.pdf").unlink()
    (out / "mine.pdf").mkdir()
    add_figure("mine", data=lambda frame: frame.assign(y=3 * frame["x"]))
    with pytest.raises(UserError, match=r"--out .*: mine\.pdf is not writable \(it is a folder\)"):
        draw_figures(["mine"], results, out, print)
    assert {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()} == before


def broken(frame: pd.DataFrame) -> Any:
    """Have a fault."""
    raise ZeroDivisionError("a fault of its own")


def unreadable(frame: pd.DataFrame) -> Figure:
    """Return a figure that cannot be saved, since its title is no formula."""
    figure = Figure(figsize=(1.0, 1.0))
    figure.suptitle(r"$\nothing$")
    return figure


@pytest.mark.parametrize(
    "fault",
    [{"SOURCE": broken}, {"data": broken}, {"draw": broken}, {"draw": unreadable}, {"texts": broken}, {"draw": None}],
    ids=["source", "data", "draw", "saving", "texts", "missing"],
)
def test_a_fault_of_another_packages_figure_is_told_and_the_rest_is_drawn(
    add_figure: AddFigure, results: Path, tmp_path: Path, fault: dict[str, Any]
) -> None:
    add_figure("faulty", **fault)
    add_figure("mine")
    told: list[str] = []
    study = Study(name="small", title="Small", question="Is it so?")
    draw_figures([], results, tmp_path / "out", told.append, study=study)
    assert (tmp_path / "out" / "mine.png").exists()
    assert not (tmp_path / "out" / "faulty.png").exists()
    assert [line for line in told if line.startswith("faulty left out")]
    assert "mine" in {drawing.name for drawing in possible_drawings(results, told.append, study)}
    with pytest.raises((ZeroDivisionError, ValueError, TypeError)):
        draw_figures(["faulty"], results, tmp_path / "out", told.append)


def test_a_figure_that_cannot_be_imported_is_told_and_the_rest_is_drawn(
    add_figure: AddFigure, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_figure("mine")
    (tmp_path / "faulty_figure.py").write_text("import nothing_of_this_name\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    group = "codesign_bench.paper_figs"
    points = {"paper_figs": {"faulty": EntryPoint("faulty", "faulty_figure", group)}}
    monkeypatch.setattr(registry, "_entry_points", lambda group: points.get(group, {}))
    told: list[str] = []
    draw_figures([], results, tmp_path / "out", told.append, study=Study(name="small", title="S", question="?"))
    assert (tmp_path / "out" / "mine.png").exists()
    assert "left out: faulty: it needs nothing_of_this_name, which is not installed" in told
    with pytest.raises(UserError, match="figure 'faulty' is not available: it needs nothing_of_this_name"):
        draw_figures(["faulty"], results, tmp_path / "out", told.append)


def test_a_refused_figure_leaves_no_folder_behind(add_figure: AddFigure, results: Path, tmp_path: Path) -> None:
    add_figure("mine", SOURCE=lacking)
    (tmp_path / "there").mkdir()
    for out in (tmp_path / "new" / "figures", tmp_path / "there"):
        with pytest.raises(UserError, match="nothing measured"):
            draw_figures(["mine"], results, out, print)
    assert not (tmp_path / "new").exists()
    assert (tmp_path / "there").exists()
