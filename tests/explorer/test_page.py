"""The page needs nothing else, computes Python's designs, and does what a person asks of it in a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builders import VERSION_0_1_0
from chromium import PROGRAM, Tab, chromium
from codesign_bench.errors import UserError
from codesign_bench.explorer import page as page_module
from codesign_bench.explorer.designers import first_look, played
from codesign_bench.explorer.goals import Goals
from codesign_bench.explorer.tools import tool_values
from codesign_bench.storage.policies import load_policy
from codesign_bench.task import load_task
from explorer_pages import NODE, data_of, in_node, write_page
from reports import Reader

AGREED = 1e-4
"""Largest difference of a normalised design in the page from Python's."""
needs_node = pytest.mark.skipif(NODE is None, reason="Node.js is not installed")
needs_browser = pytest.mark.skipif(PROGRAM is None, reason="no Chromium is installed")


def policy_of(cell: dict[str, Any]) -> Any:
    """Return the policy of a cell of the page."""
    return load_policy(VERSION_0_1_0 / "push" / cell["method"] / "default" / f"seed-{cell['seed']:02d}")


def test_the_page_needs_no_other_file_and_no_network(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    reader = Reader(text)
    assert [address for address in reader.addresses if not address.startswith("#")] == []
    assert [word for word in ("@import", "url(", "fetch(", "XMLHttpRequest", "import(") if word in text] == []
    assert "default-src 'none'" in text
    assert [name for name in reader.names if name.startswith("on")] == []
    assert len(reader.identities) == len(set(reader.identities))


@needs_node
def test_the_pages_script_computes_pythons_designs_tools_and_frames(page: Path) -> None:
    (task_data,) = data_of(page.read_text(encoding="utf-8"))["tasks"]
    goals = Goals.of(load_task("push"))
    points = goals.random_points(np.random.default_rng(5), 25)
    answers = in_node([task_data], [(0, index, points) for index in range(len(task_data["cells"]))])
    kinds = [cell["designer"]["kind"] for cell in task_data["cells"]]
    assert {"network", "one"} <= set(kinds)
    for cell, answer in zip(task_data["cells"], answers, strict=True):
        designs = played(policy_of(cell), first_look(goals, points))
        np.testing.assert_allclose(answer["designs"], designs, atol=AGREED)
        np.testing.assert_allclose(answer["tools"], tool_values(goals.task, designs.astype(float))[1], atol=2e-3)
        recorded = played(policy_of(cell), first_look(goals, np.array(task_data["points"])))
        np.testing.assert_allclose(np.reshape(answer["recorded"], recorded.shape), recorded, atol=1e-6)
        assert all(len(frames) > 1 for frames in answer["frames"])
        starts = np.array([frames[0][:2] for frames in answer["frames"]])
        np.testing.assert_allclose(starts, task_data["points"], atol=cell["frames"]["unit"], err_msg="the goal's ring")


@needs_node
def test_the_nearest_recorded_goal_is_found(page: Path) -> None:
    (task_data,) = data_of(page.read_text(encoding="utf-8"))["tasks"]
    (answer,) = in_node([task_data], [(0, 0, np.array(task_data["points"]) + 0.01)])
    assert answer["nearest"] == list(range(len(task_data["points"])))


@pytest.fixture(scope="module")
def tab(page: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    """Return a browser with the page."""
    if PROGRAM is None:
        pytest.skip("no Chromium is installed")
    with chromium(tmp_path_factory.mktemp("browser")) as opened:
        opened.open(page)
        yield opened


def box_of(tab: Tab, name: str) -> dict[str, float]:
    """Return where a part of panel A is."""
    script = f"page.panels[0].root.querySelector('[data-part={name}]')"
    tab.run(f"{script}.scrollIntoView({{block: 'center'}})")
    found: dict[str, float] = tab.run(
        f"(({{x, y, width, height}}) => ({{x, y, width, height}}))({script}.getBoundingClientRect())"
    )
    return found


@needs_browser
def test_dragging_the_goal_changes_the_tool_to_the_policys_own(page: Path, tab: Tab) -> None:
    (task_data,) = data_of(page.read_text(encoding="utf-8"))["tasks"]
    goals = Goals.of(load_task("push"))
    box = box_of(tab, "map")
    middle = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse("mousePressed", *middle)
    before = tab.run("page.state.point"), tab.run("Array.from(page.panels[0].design)")
    tab.mouse("mouseMoved", middle[0] + 0.3 * box["width"], middle[1] - 0.2 * box["height"])
    tab.mouse("mouseReleased", middle[0] + 0.3 * box["width"], middle[1] - 0.2 * box["height"])
    point, design = tab.run("page.state.point"), tab.run("Array.from(page.panels[0].design)")
    assert point[0] > before[0][0] + 1.0
    assert point[1] > before[0][1] + 1.0
    assert np.abs(np.array(design) - before[1]).max() > AGREED
    expected = played(policy_of(task_data["cells"][0]), first_look(goals, np.array([point])))[0]
    np.testing.assert_allclose(design, expected, atol=AGREED)
    assert "nearest recorded goal" in tab.run("page.panels[0].root.querySelector('[data-part=status]').textContent")


@needs_browser
def test_the_goal_can_be_dragged_in_the_scene(tab: Tab) -> None:
    box = box_of(tab, "scene")
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseReleased", x, y)
    # The view of push shows x from 4 to 30 m and y from -1 to 17 m.
    assert tab.run("page.state.point") == pytest.approx([17.0, 8.0], abs=0.1)


@needs_browser
def test_the_goal_moves_by_keys_and_both_panels_share_it(tab: Tab) -> None:
    tab.run("page.panels[0].root.querySelector('[data-part=map]').focus()")
    before = tab.run("page.state.point")
    tab.key("ArrowLeft")
    tab.key("ArrowDown")
    after = tab.run("page.state.point")
    assert after[0] < before[0]
    assert after[1] < before[1]
    labels = tab.run(
        "page.panels.map((panel) => panel.root.querySelector('[data-part=map]').getAttribute('aria-label'))"
    )
    assert len({label.split("Goal: ")[1].split(". Nearest")[0] for label in labels}) == 1


@needs_browser
def test_playing_runs_to_the_end_of_the_episode_and_changes_the_picture(tab: Tab) -> None:
    picture = "page.panels[0].root.querySelector('[data-part=scene]').toDataURL()"
    before = tab.run(picture)
    tab.run("document.getElementById('play').click()")
    ended = "!page.state.playing && page.state.time > 0"
    tab.run(
        f"new Promise((done) => {{ const look = () => {ended} ? done(true) : requestAnimationFrame(look); look(); }})"
    )
    assert tab.run("page.state.time") == pytest.approx(float(tab.run("document.getElementById('time').max")))
    assert tab.run(picture) != before
    assert "Shown" in tab.run("page.panels[0].root.querySelector('[data-part=status]').textContent")


@needs_browser
@pytest.mark.parametrize("width", [1400, 420])
def test_the_page_fits_the_window_and_every_control_has_a_name(width: int, page: Path, tab: Tab) -> None:
    tab.open(page, width)
    assert tab.run("document.documentElement.scrollWidth") <= width
    unnamed = """[...document.querySelectorAll("select, input, button, canvas")].filter((control) =>
        !control.labels?.length && !control.getAttribute("aria-label") && !control.textContent.trim()).length"""
    assert tab.run(unnamed) == 0


@needs_browser
def test_another_task_can_be_chosen(page: Path, tab: Tab, tmp_path: Path) -> None:
    (task,) = data_of(page.read_text(encoding="utf-8"))["tasks"]
    small = {**task, "points": task["points"][:1], "cells": [_with_one_goal(cell) for cell in task["cells"]]}
    other = tmp_path / "two_tasks.html"
    other.write_text(page_module.render([small, task], "two tasks"), encoding="utf-8")
    tab.open(other)
    tab.run("document.getElementById('task').value = 1")
    tab.run("document.getElementById('task').dispatchEvent(new Event('change'))")
    tab.until(f"page.state.task.points.length === {len(task['points'])} && page.panels.every((panel) => panel.cell)")
    assert tab.errors() == []
    tab.open(page)


def _with_one_goal(cell: dict[str, Any]) -> dict[str, Any]:
    """Return a cell with only its first recorded goal."""
    firsts = {name: cell[name][:1] for name in ("success", "returns", "lengths")}
    return {**cell, **firsts, "frames": {**cell["frames"], "structures": cell["frames"]["structures"][:1]}}


@needs_browser
def test_nothing_failed_and_nothing_was_asked_of_a_network(page: Path, tab: Tab) -> None:
    assert tab.errors() == []
    assert [address for address in tab.requests() if not address.startswith("file://")] == []


def test_a_page_that_would_be_too_large_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page_module, "MOST_BYTES", 50_000)
    with pytest.raises(UserError, match=r"larger than .* --task, --method or --seeds, or fewer goals with --goals"):
        write_page(tmp_path / "new" / "explorer.html")
    assert not (tmp_path / "new").exists()
