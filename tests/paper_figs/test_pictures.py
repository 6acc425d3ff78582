"""Pictures in figures: what is cut off."""

from __future__ import annotations

import numpy as np

from codesign_bench.paper_figs._pictures import cut_to_content, cut_to_differences
from pictures import picture


def test_pictures_are_cut_alike_to_where_they_differ() -> None:
    first, second = cut_to_differences([picture(20, 20), picture(20, 60)], aspect=1.0)
    # Squares from column 20 to 69; a margin of 4 % of 120, which is 5; as high as wide, within 90 rows.
    assert first.shape == second.shape == (60, 60, 3)
    assert np.flatnonzero((first == 0).any(axis=(0, 2))).tolist() == list(range(5, 15))
    assert np.flatnonzero((second == 0).any(axis=(0, 2))).tolist() == list(range(45, 55))


def test_equal_pictures_are_left_whole() -> None:
    assert cut_to_differences([picture(0, 0), picture(0, 0)])[0].shape == (90, 120, 3)


def test_a_tool_that_is_the_same_in_all_pictures_is_not_cut_off() -> None:
    first, second = picture(20, 20), picture(20, 60)
    for one in (first, second):
        one[80:84, 30:34] = [44, 111, 187]
        one[84:88, 30:34] = [22, 55, 93]  # in shade
    for cut in cut_to_differences([first, second], aspect=1.0):
        assert (cut[..., 2] > cut[..., 0]).sum() == 4 * 4 + 4 * 4


def test_a_single_picture_keeps_most_of_itself_and_all_of_its_content() -> None:
    cut = cut_to_content(picture(40, 55))
    assert cut.shape == (63, 84, 3)  # 70 % of both
    assert (cut == 0).sum() == 10 * 10 * 3


def test_a_high_picture_loses_top_and_bottom() -> None:
    high = np.zeros((100, 80, 3), dtype=np.uint8)
    high[0, 0] = 255
    assert cut_to_content(high, aspect=4 / 3).shape == (60, 80, 3)
