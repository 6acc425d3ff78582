"""The gallery of tasks: one titled picture each, in the order of listings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from codesign_bench.errors import UserError
from codesign_bench.paper_figs._pictures import cut_to_content
from codesign_bench.registry import load_module
from pictures import picture

gallery: Any = load_module("paper_figs", "task_gallery")


def scene(task: str) -> dict[str, Any]:
    """Return one task's row of the gallery."""
    values = {"instance": 0, "step": 6, "steps": 10, "return": 1.0, "success": 1, "picture": picture(40, 55)}
    return {"task": task, "title": task.title(), **values}


def test_the_gallery_has_one_titled_picture_per_task_in_the_papers_order() -> None:
    figure = gallery.draw(pd.DataFrame([scene(task) for task in ("other", "scoop", "push", "fetch_cube")]))
    titles = [axis.get_title() for axis in figure.axes if axis.images]
    assert titles == ["Push", "Scoop", "Fetch_Cube", "Other"]
    (shown, *_) = [axis.images[0].get_array() for axis in figure.axes if axis.images]
    assert np.array_equal(shown, cut_to_content(picture(40, 55)))


def test_a_gallery_without_pictures_is_refused() -> None:
    with pytest.raises(UserError, match="have no rows"):
        gallery.data(pd.DataFrame([scene("push")]).iloc[:0])
    with pytest.raises(UserError, match="lack the column steps"):
        gallery.draw(pd.DataFrame([scene("push")]).drop(columns="steps"))
