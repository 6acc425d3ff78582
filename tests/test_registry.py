"""Members are found by their file's name, as entry points, or because they were registered."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest

from builders import write_files
from codesign_bench import registry
from codesign_bench.cell.axes import axes
from codesign_bench.config.profiles import profiles
from codesign_bench.errors import UnavailableError, UserError
from codesign_bench.figures.drawing import figure_names
from codesign_bench.task import Task, usable_tasks

pytestmark = pytest.mark.usefixtures("toy")


class Base:
    """What a member has to be."""


def module_with(**members: type) -> ModuleType:
    """Return a module named `made_here` that defines these classes."""
    module = ModuleType("made_here")
    for name, member in members.items():
        member.__module__ = module.__name__
        setattr(module, name, member)
    return module


@pytest.mark.parametrize("group", registry.KINDS)
def test_built_in_names_are_those_of_the_files_and_the_presented_come_first(group: str) -> None:
    presented, built_in = registry.presented(group), registry.built_in(group)
    assert built_in[: len(presented)] == presented
    assert list(built_in[len(presented) :]) == sorted(built_in[len(presented) :])
    assert not any(name.startswith("_") for name in built_in)
    assert registry.names(group)[: len(built_in)] == built_in


def test_what_is_registered_comes_last_and_can_be_loaded() -> None:
    assert registry.names("tasks")[-1] == "toy_reach"
    assert registry.load("tasks", "toy_reach", Task)().name == "toy_reach"
    assert registry.load("tasks", "push", Task)().name == "push"


def test_names_are_put_into_the_order_of_listings_each_once_and_unknown_ones_last() -> None:
    found = registry.in_order("tasks", ["zebra", "toy_reach", "scoop", "apple", "push", "scoop"])
    assert found == ["push", "scoop", "toy_reach", "apple", "zebra"]


@pytest.mark.parametrize(("group", "kind"), registry.KINDS.items())
def test_an_unknown_name_is_answered_with_those_there_are(group: str, kind: str) -> None:
    with pytest.raises(UserError, match=f"unknown {kind} 'nothing'; choose from: ") as told:
        registry.load(group, "nothing", Base)
    assert all(name in str(told.value) for name in registry.names(group))
    with pytest.raises(UserError, match=f"unknown {kind} 'nothing'"):
        registry.load_module(group, "nothing")


def test_a_figure_or_a_study_must_be_a_module() -> None:
    registry.register("paper_figs", "a_class", lambda: Base)
    with pytest.raises(TypeError, match="the figure 'a_class' must be a module, not type"):
        registry.load_module("paper_figs", "a_class")
    module = ModuleType("a_module")
    registry.register("paper_figs", "a_module", lambda: module)
    assert registry.load_module("paper_figs", "a_module") is module


def test_a_study_without_its_attribute_is_told() -> None:
    module = ModuleType("my_study")
    registry.register("studies", "my_study", lambda: module)
    with pytest.raises(TypeError, match="my_study is registered as a study and must define STUDY"):
        registry.load_attribute("studies", "my_study", "STUDY")
    module.STUDY = "what it is"  # type: ignore[attr-defined]
    assert registry.load_attribute("studies", "my_study", "STUDY") == "what it is"


def test_a_file_has_one_public_class_of_its_kind() -> None:
    public, private = type("Mine", (Base,), {}), type("_Help", (Base,), {})
    module = module_with(Mine=public, _Help=private)
    module.Imported = type("Imported", (Base,), {"__module__": "elsewhere"})  # type: ignore[attr-defined]
    assert registry.single_subclass(module, Base) is public
    with pytest.raises(TypeError, match="made_here must define one public Base, not 0"):
        registry.single_subclass(module_with(_Help=private), Base)
    with pytest.raises(TypeError, match="made_here must define one public Base, not 2"):
        registry.single_subclass(module_with(Mine=public, Other=type("Other", (Base,), {})), Base)


def entries(modules: Path, text: str) -> None:
    """Install a package whose entry points are `text`."""
    about = {"METADATA": "Metadata-Version: 2.1\nName: needy\nVersion: 1.0\n", "entry_points.txt": text}
    write_files(modules / "needy-1.0.dist-info", about)


def test_members_that_cannot_be_imported_are_left_out_with_one_line_for_each_reason(modules: Path) -> None:
    entries(modules, "[codesign_bench.tasks]\nfirst = needy.one\nsecond = needy.two\nthird = needy.three\n")
    needs = "import package_that_nobody_has.part\n"
    write_files(modules / "needy", {"__init__.py": "", "one.py": needs, "two.py": needs})
    told: list[str] = []
    assert usable_tasks(["first", "push", "second", "third"], told.append) == ["push"]
    assert told == [
        "left out: first, second: it needs package_that_nobody_has, which is not installed",
        "left out: third: it needs needy, which is not installed",
    ]
    with pytest.raises(UnavailableError, match="task 'first' is not available: it needs package_that_nobody_has"):
        registry.load("tasks", "first", Task)


def test_a_figure_and_a_study_that_cannot_be_imported_keep_no_other_from_use(modules: Path) -> None:
    entries(modules, "[codesign_bench.paper_figs]\nmine = needy.fig\n[codesign_bench.studies]\nours = needy.study\n")
    write_files(
        modules / "needy",
        {"__init__.py": "", "fig.py": "from numpy import nothing_of_this_name\n", "study.py": "import x_y_z\n"},
    )
    told: list[str] = []
    assert "mine" not in figure_names(None, told.append)
    assert len(told) == 1
    assert told[0].startswith("left out: mine: cannot import name 'nothing_of_this_name' from 'numpy'")
    assert "alpha" in axes()
    assert "paper" in profiles()


def test_a_fault_in_our_own_files_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "codesign_bench.tasks.push", None)
    with pytest.raises(ModuleNotFoundError):
        registry.load("tasks", "push", Task)
