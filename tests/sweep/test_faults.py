"""Whatever file operation fails, or is the last before a kill: the data are safe and the same command resumes."""

from __future__ import annotations

from pathlib import Path

import pytest

from injected_faults import campaign, start_together

pytestmark = pytest.mark.usefixtures("toy", "every_batch")


def wrong(folder: Path, every: int, first: int = 0) -> list[str]:
    """Return what is wrong with sweeps in which every `every`-th operation fails."""
    found = list(campaign(folder, every, first))
    assert len(found) > 12
    return [f"{fault}: {line}" for fault, complaints in found for line in complaints]


def test_some_operations_fail_and_the_same_command_resumes(tmp_path: Path) -> None:
    assert wrong(tmp_path, every=47, first=3) == []


@pytest.mark.slow
def test_every_operation_fails_and_the_same_command_resumes(tmp_path: Path) -> None:
    assert wrong(tmp_path, every=1) == []


@pytest.mark.parametrize("count", [2, 4])
def test_sweeps_that_start_together_on_a_new_folder_all_end_well(tmp_path: Path, count: int) -> None:
    for ended in start_together(tmp_path, count):
        assert ended.code == 0, ended.text


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 4, 8])
def test_a_hundred_times_sweeps_that_start_together_all_end_well(tmp_path: Path, count: int) -> None:
    for turn in range(100):
        (tmp_path / str(turn)).mkdir()
        for ended in start_together(tmp_path / str(turn), count):
            assert ended.code == 0, ended.text
