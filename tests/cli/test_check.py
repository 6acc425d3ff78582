"""`codesign-bench check` prints every check as it ends, and its exit code says whether something is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench import registry
from codesign_bench.cli import main
from sound import SoundReach, SoundSearch, changed_method, changed_task

pytestmark = pytest.mark.usefixtures("toy")

BOTH = ("check", "--task", "sound_reach", "--method", "sound_search", "--on", "sound_reach")


@pytest.fixture(autouse=True)
def members(toy: None) -> None:
    """Make the sound members known."""
    registry.register("tasks", SoundReach.name, lambda: SoundReach)
    registry.register("methods", SoundSearch.name, lambda: SoundSearch)


def test_sound_members_pass(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(BOTH) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "task sound_reach"
    assert printed[1] == "  passed    It can be loaded, and everything that a task must define is there."
    assert "method sound_search on sound_reach" in printed
    assert printed[-1] == "2 of 2 keep the contract"
    assert not any(line.startswith("  wrong") for line in printed)


def test_what_is_wrong_is_told_with_what_is_expected_and_where_to_read(capsys: pytest.CaptureFixture[str]) -> None:
    registry.register("tasks", SoundReach.name, lambda: changed_task(scene={}))
    assert main(BOTH) == 1
    printed = capsys.readouterr().out.splitlines()
    wrong = printed.index("  wrong     Every number of its scene has a unit and a source.")
    assert printed[wrong + 1] == "            found:    `scene` is empty"
    assert printed[wrong + 2].startswith("            expected: `scene = constants(__name__)`")
    assert printed[wrong + 3] == "            read:     codesign_bench.task.Task.scene"
    assert printed[-1] == "1 of 2 keep the contract; not: task sound_reach"


def test_nothing_else_is_asked_where_it_would_mean_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    registry.register("methods", SoundSearch.name, lambda: changed_method(config_class=dict))
    assert main(["check", "--method", "sound_search", "--on", "sound_reach"]) == 1
    printed = capsys.readouterr().out.splitlines()
    assert printed[-2] == "  The other checks mean nothing before this is right."
    assert printed[-1] == "method sound_search on sound_reach: 1 passed, 1 wrong"


UNFINISHED = """
from codesign_bench.task import Task
class Unfinished(Task):
    name = "unfinished"
"""


def test_a_class_with_a_name_that_lacks_methods_is_told_so(modules: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (modules / "unfinished_task.py").write_text(UNFINISHED)
    assert main(["check", "--import", "unfinished_task", "--task", "unfinished"]) == 1
    printed = capsys.readouterr().out
    assert "loading it raised TypeError: Can't instantiate abstract class Unfinished" in printed
    assert "effort" in printed


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["check"], "--task or --method"),
        (["check", "--task", "pull"], "sound_reach"),
        (["check", "--method", "fly"], "sound_search"),
        (["check", "--method", "sound_search", "--on", "pull"], "sound_reach"),
        (["check", "--task", "sound_reach", "--on", "sound_reach"], "--method"),
    ],
)
def test_unknown_names_are_refused(arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    printed = capsys.readouterr().err.strip()
    assert named in printed
    assert printed.count("\n") <= 1
