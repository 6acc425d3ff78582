"""The pages of tasks are what the script makes of tasks and notes, and the script makes what it should."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from codesign_bench.task import Box, load_task

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The script that writes the pages."""
    spec = importlib.util.spec_from_file_location("make_task_pages", ROOT / "docs" / "make_task_pages.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_page_is_up_to_date(script: Any) -> None:
    stale = [path.name for path, text in script.pages() if path.read_text(encoding="utf-8") != text]
    assert stale == [], "run: python docs/make_task_pages.py"


def test_a_page_that_was_changed_by_hand_is_told_and_written_again(
    script: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "docs" / "push.md"
    path.parent.mkdir()
    monkeypatch.setattr(script, "ROOT", tmp_path)
    monkeypatch.setattr(script, "pages", lambda: [(path, "# push\n")])
    assert script.main(["--check"]) == 1
    assert "docs/push.md is out of date: run python docs/make_task_pages.py" in capsys.readouterr().err
    assert not path.exists(), "a check writes nothing"
    assert script.main([]) == 0
    assert path.read_text() == "# push\n"
    assert script.main(["--check"]) == 0


def test_a_page_holds_the_notes_with_links_as_seen_from_its_folder(script: Any) -> None:
    notes = "# Notes\n\n## Frames\n\nSee [there](../../deployment.md) and [here](https://example.org).\n"
    assert (
        script._inside(notes).strip() == "## Frames\n\nSee [there](../deployment.md) and [here](https://example.org)."
    )


def test_docstrings_split_into_sections(script: Any) -> None:
    intro, sections = script.docstring_parts(load_task("push"))
    assert intro.startswith("Push a round puck")
    assert list(sections) == [
        *("Action space", "Observation", "Design space", "Goal space", "Reward", "Starting state", "Episode end"),
    ]
    assert sections["Action space"].startswith("Design, 5:")


def test_the_meaning_of_a_constant_is_the_docstring_behind_it(script: Any) -> None:
    source = 'A: float = 1.0\n"""Of the\npuck."""\nB: int = 2\nC: int = 3\n"""Of the goal."""\n'
    assert script.attribute_docs(ast.parse(source).body) == {"A": "Of the puck.", "C": "Of the goal."}


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.5, "m", "0.5"),
        (3, "balls", "3"),
        (1.0 / 60.0, "s", "1/60"),
        (0.25, "s", "0.25"),
        (np.pi / 2.0, "rad", "1.571 (90°)"),
        (0.0, "rad", "0"),
        (True, "", "yes"),
        (np.array([20.0, 10.0]), "m", "(20, 10)"),
        (((1, 2), (3, 4)), "m", "((1, 2), (3, 4))"),
        (Box.of(x=(0.0, 1.0, "m"), y=(-1.0, 2.5, "m")), "m", "x 0 to 1, y -1 to 2.5"),
    ],
)
def test_numbers_are_written_as_people_read_them(script: Any, value: Any, unit: str, text: str) -> None:
    assert script.number(value, unit) == text


def test_a_long_series_of_an_observation_has_one_row(script: Any) -> None:
    rows = list(script._observation(load_task("scoop")))
    entries = [row[1] for row in rows]
    assert ("21 to 44", "`surface_1` to `surface_24`") in [row[:2] for row in rows]
    assert "`wants_1`" in entries, "a short series is written out"
    assert rows[-1][0].endswith(f" to {load_task('scoop').layout.size - 1}")
