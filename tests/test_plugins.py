"""Modules that are named on the command line register what they define, here and in processes started from here."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from codesign_bench import registry
from codesign_bench.errors import UnavailableError, UserError
from codesign_bench.plugins import import_modules
from codesign_bench.registry import IMPORTS_VARIABLE, names

pytestmark = pytest.mark.usefixtures("toy")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which modules are found."""
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def test_tasks_and_methods_are_registered_under_their_own_names() -> None:
    assert "toy_reach" in names("tasks")
    assert "toy_search" in names("methods")
    assert os.environ[IMPORTS_VARIABLE] == "toy"


def test_what_a_module_imports_is_not_its_own(folder: Path) -> None:
    (folder / "mine_borrowing.py").write_text(
        "from toy import ToyReach\n\nclass Mine(ToyReach):\n    name = 'mine'\n\nclass Unfinished(ToyReach):\n"
        "    name = 'unfinished'\n    from abc import abstractmethod\n    @abstractmethod\n    def more(self): ...\n"
    )
    before = names("tasks")
    import_modules(["mine_borrowing"])
    assert set(names("tasks")) - set(before) == {"mine"}


def test_a_module_with_a_study_or_a_figure_is_that_study_or_figure(folder: Path) -> None:
    (folder / "pack").mkdir()
    (folder / "pack" / "my_figure.py").write_text("TITLE = 'Mine'\ndata = draw = len\n")
    (folder / "pack" / "half_a_figure.py").write_text("TITLE = 'Half'\ndata = len\n")
    (folder / "question.py").write_text(
        "from codesign_bench.study import Study\n"
        "STUDY = Study(name='asked', title='A study', question='Is it so?', claims=list)\n"
    )
    import_modules(["pack.my_figure", "pack.half_a_figure", "question"])
    assert "my_figure" in names("paper_figs")
    assert "half_a_figure" not in names("paper_figs")
    assert registry.load_attribute("studies", "asked", "STUDY").title == "A study"


def test_what_was_imported_before_is_registered_again_and_named_once(folder: Path) -> None:
    (folder / "empty_module.py").write_text("")
    registry._registered.clear()  # as in a new process, which has the variable alone
    import_modules(["empty_module", "toy"])
    assert "toy_reach" in names("tasks")
    assert os.environ[IMPORTS_VARIABLE] == "toy,empty_module"


def test_a_module_that_is_not_there_is_told_from_one_that_lacks_another(folder: Path) -> None:
    with pytest.raises(UserError, match="--import: no module named 'nowhere_to_find'"):
        import_modules(["nowhere_to_find"])
    (folder / "lacking.py").write_text("import a_missing_library\n")
    with pytest.raises(UnavailableError, match="--import lacking is not available: it imports 'a_missing_library'"):
        import_modules(["lacking"])
    assert os.environ[IMPORTS_VARIABLE] == "toy"
