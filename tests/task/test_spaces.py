"""Spaces whose entries are found by name, and the parts of an observation."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.task import Box, Layout

STATE = Box.of(
    puck_x=(-6.0, 30.0, "m"), puck_y=(-6.0, 30.0, "m"), ball_1=(0.0, 1.0, "1"), ball_2=(0.0, 2.0, "1"), end=(0, 3, "")
)


def test_a_space_keeps_the_order_in_which_its_entries_are_given() -> None:
    assert STATE.names == ("puck_x", "puck_y", "ball_1", "ball_2", "end")
    assert STATE.high == (30.0, 30.0, 1.0, 2.0, 3)
    assert STATE.units == ("m", "m", "1", "1", "")
    assert STATE.size == 5
    assert Box.of().size == 0


def test_bounds_map_to_minus_one_and_one_and_back() -> None:
    low, high = STATE.bounds
    np.testing.assert_array_equal(STATE.to_unit([low, high]), [-np.ones(5), np.ones(5)])
    np.testing.assert_array_equal(STATE.from_unit([-np.ones(5), np.ones(5)]), [low, high])


def test_samples_lie_between_the_bounds() -> None:
    low, high = STATE.bounds
    samples = STATE.sample(np.random.default_rng(0), 100)
    assert samples.shape == (100, 5)
    assert ((low <= samples) & (samples <= high)).all()


def test_entries_are_found_by_name() -> None:
    values = np.arange(5.0)
    assert values[STATE.index("ball_2")] == 3.0
    assert values[STATE.slice("puck_x", "puck_y")].tolist() == [0.0, 1.0]
    assert values[STATE.slice("end")].tolist() == [4.0]
    assert values[STATE.group("ball_")].tolist() == [2.0, 3.0]


def test_a_name_that_is_not_there_is_answered_with_those_that_are() -> None:
    for find in (STATE.index, STATE.slice, STATE.part):
        with pytest.raises(ValueError, match="no entry 'ball_3' among: puck_x, puck_y, ball_1, ball_2, end"):
            find("ball_3")


@pytest.mark.parametrize("names", [("puck_y", "puck_x"), ("puck_x", "ball_1"), ("end", "puck_x"), ()])
def test_a_slice_is_of_neighbours_in_the_order_of_the_space(names: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="not adjacent in this order"):
        STATE.slice(*names)


def test_a_group_has_members_and_nothing_between_them() -> None:
    with pytest.raises(ValueError, match="no names"):
        STATE.group("cube_")
    with pytest.raises(ValueError, match="not adjacent"):
        Box.of(ball_1=(0.0, 1.0, "1"), end=(0.0, 1.0, "1"), ball_2=(0.0, 1.0, "1")).group("ball_")


def test_a_part_has_the_entries_asked_for_in_the_order_asked_for() -> None:
    assert STATE.part("ball_2", "puck_x") == Box.of(ball_2=(0.0, 2.0, "1"), puck_x=(-6.0, 30.0, "m"))
    assert STATE.part() == Box.of()


def test_spaces_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match="differ in length"):
        Box(("x",), (0.0, 0.0), (1.0,), ("m",))
    with pytest.raises(ValueError, match="two entries have the same name"):
        Box(("x", "x"), (0.0, 0.0), (1.0, 1.0), ("m", "m"))


def test_an_observation_splits_into_its_parts() -> None:
    layout = Layout.of(state=4, goal=2, design=1)
    assert layout.size == 4 + 2 + 1 + len(Layout.PHASE_NAMES)
    single = np.arange(10, dtype=np.float32)
    parts = layout.split(single)
    assert [part.tolist() for part in parts] == [[0, 1, 2, 3], [4, 5], [6], [7, 8, 9]]
    batch = layout.split(np.stack([single, single + 100.0]))
    assert batch.goal.tolist() == [[4, 5], [104, 105]]
    parts.state[0] = -1.0
    assert single[0] == -1.0, "parts are views"
