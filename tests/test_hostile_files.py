"""Every command meets damaged and hostile files in time and memory, without a traceback, and names them.

All combinations take hours by hand: see `hostile_files.py`.
"""

from __future__ import annotations

import pytest
from hostile_files import FOLDER_COMMANDS, campaign, combinations

CHEAP = ("status", "load_results", "load_policy", "run", "resume", "tuned")
"""Commands that take a fraction of a second."""


def chosen(commands: tuple[str, ...], every: int) -> list[int]:
    """Return the numbers of every so many combinations of these commands."""
    return [number for number, (_, command) in enumerate(combinations()) if command in commands][::every]


def test_the_campaign_is_as_large_as_it_says() -> None:
    listed = combinations()
    assert len(listed) >= 2_700
    assert len(set(listed)) == len(listed)


def test_quick_commands_meet_a_sample_of_damages() -> None:
    assert campaign(chosen(CHEAP, 25)) == []


@pytest.mark.slow
def test_every_command_meets_a_larger_sample_of_damages() -> None:
    numbers = sorted({*chosen(FOLDER_COMMANDS, 23), *chosen(("render", "export", "deploy"), 11), *chosen(CHEAP, 3)})
    assert campaign(numbers) == []
