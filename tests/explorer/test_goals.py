"""Goals of a page: every point of its axes is an instance of the task, and recorded ones are in the training region."""

from __future__ import annotations

import numpy as np
import pytest

from codesign_bench.explorer.goals import Goals, product_of
from codesign_bench.task import load_task, task_names


@pytest.mark.parametrize("name", task_names())
def test_points_are_instances_and_recorded_ones_are_in_the_region(name: str) -> None:
    task = load_task(name)
    goals = Goals.of(task)
    points = goals.random_points(np.random.default_rng(0), 20)
    instances = goals.instances(points)
    assert instances.shape == (20, task.instance_space.size)
    np.testing.assert_array_equal(instances[:, : task.goal_size], points[:, : task.goal_size])
    known = task.evaluation_instances()[:, task.goal_size :]
    assert all((known == hidden).all(axis=1).any() for hidden in instances[:, task.goal_size :])
    recorded = goals.recorded(16)
    assert len(recorded) > 1
    assert goals.inside(recorded).all()


def test_whole_numbers_are_listed_and_what_varies_besides_is_an_axis() -> None:
    wanted, variation = Goals.of(load_task("scoop")).axes
    assert wanted.values == tuple(range(1, 8))
    assert (variation.name, len(variation.values)) == ("variation", 8)


def test_a_grid_divides_smooth_axes_into_fields_and_is_as_large_as_requested() -> None:
    goals = Goals.of(load_task("fetch_cube"))
    across, up = goals.grid(64)
    np.testing.assert_allclose(np.diff(across), (across[0] - goals.axes[0].low) * 2.0)
    assert len(across) * len(up) == 64
    # The ring of push fills less of its square, so the grid is finer.
    assert 40 <= len(Goals.of(load_task("push")).recorded(64)) <= 90


def test_the_mask_shows_the_training_region_where_it_is_no_rectangle() -> None:
    mask = Goals.of(load_task("push")).mask()
    assert mask is not None
    middle = len(mask) // 2
    assert not mask[middle, middle]
    assert mask[middle, -1]
    assert Goals.of(load_task("fetch_cube")).mask() is None


def test_the_last_axis_of_a_product_changes_fastest() -> None:
    product = product_of([np.array([0.0, 1.0]), np.array([5.0, 6.0])])
    assert product.tolist() == [[0, 5], [0, 6], [1, 5], [1, 6]]
