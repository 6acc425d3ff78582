"""Constants of a scene, collected from the annotations of a module."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Annotated

import pytest

from codesign_bench.task.scene import OURS, Constant, Given, by_row, constants


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A module with two constants and two names that are none."""
    result = ModuleType("a_scene")
    result.__annotations__ = {
        "RADIUS": 'Annotated[float, Given("m", OURS)]',
        "STEPS": 'Annotated[int, "for readers", Given("1", "paper, table 1", "Steps")]',
        "LABEL": "Annotated[str, 'no constant']",
        "COUNT": "int",
    }
    vars(result).update(RADIUS=0.5, STEPS=4, LABEL="x", COUNT=3, Annotated=Annotated, Given=Given, OURS=OURS)
    monkeypatch.setitem(sys.modules, "a_scene", result)
    return result


def test_constants_are_what_is_annotated_with_a_source(module: ModuleType) -> None:
    assert constants(module.__name__) == {
        "RADIUS": Constant(0.5, "m", "ours", ""),
        "STEPS": Constant(4, "1", "paper, table 1", "Steps"),
    }


def test_constants_are_found_by_the_row_that_they_stand_for(module: ModuleType) -> None:
    assert {row: constant.value for row, constant in by_row(constants(module.__name__)).items()} == {"Steps": 4}


def test_two_constants_for_one_row_are_refused(module: ModuleType) -> None:
    twice = {**constants(module.__name__), "MORE_STEPS": Constant(5, "1", OURS, "Steps")}
    with pytest.raises(ValueError, match="MORE_STEPS is the second constant for the row 'Steps'"):
        by_row(twice)
