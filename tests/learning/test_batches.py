"""How the slots of a batch are counted and divided into groups."""

from __future__ import annotations

import pytest

from codesign_bench.learning.batches import group_sizes, slots_for


@pytest.mark.parametrize(
    ("slots", "most", "sizes"),
    [
        (1, 1_000, [1]),
        (66, 1_000, [66]),
        (191, 1_000, [191]),
        (192, 1_000, [96, 96]),
        (331, 1_000, [166, 165]),
        (495, 1_000, [124, 124, 124, 123]),
        (24, 24, [24]),
        (25, 24, [13, 12]),
        (99, 24, [17, 17, 17, 16, 16, 16]),
    ],
)
def test_how_slots_are_grouped_follows_from_their_number_and_the_tasks_most(
    slots: int, most: int, sizes: list[int]
) -> None:
    assert group_sizes(slots, most) == sizes


@pytest.mark.parametrize(
    ("steps", "most", "expected"),
    [(600, None, 100), (30, None, 5), (1, None, 1), (600, 8, 8), (24, 8, 4)],
)
def test_as_many_slots_as_give_whole_episodes(steps: int, most: int | None, expected: int) -> None:
    assert slots_for(steps, episode_steps=6, most=most) == expected
