"""Ranges of settings: what they draw, under which conditions, and that any draw of any method is a valid setting."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from codesign_bench.config.resolve import resolve
from codesign_bench.config.search import Choice, Integer, LogUniform, Range, Uniform, draw, ranges
from codesign_bench.method import load_method, method_names
from codesign_bench.task import task_names

NEARLY_ONE = float(np.nextafter(1.0, 0.0))


@dataclass(frozen=True)
class Config:
    """Settings with and without a range."""

    rate: float = field(default=0.1, metadata={"search": LogUniform(0.01, 1.0), "source": "ours"})
    epochs: int = field(default=3, metadata={"search": Integer(1, 4, where=("kind", "slow"))})
    kind: str = "fast"
    width: int = 8


@dataclass(frozen=True)
class WithoutRate(Config):
    """Inherits a setting that has no effect here."""

    not_searched: ClassVar = ("rate",)


@pytest.mark.parametrize(
    ("searched", "share", "value"),
    [
        (Uniform(-2.0, 0.0), 0.0, -2.0),
        (Uniform(-2.0, 0.0), 0.25, -1.5),
        (LogUniform(1e-4, 1e-2), 0.5, 1e-3),
        (LogUniform(1e-5, 3e-3), NEARLY_ONE, 3e-3),
        (Integer(1, 4), 0.0, 1),
        (Integer(1, 4), 0.5, 3),
        (Integer(1, 4), NEARLY_ONE, 4),
        (Integer(1, 7, log=True), 1 / 3 + 1e-9, 2),  # 8 to the power of a third
        (Integer(1, 7, log=True), NEARLY_ONE, 7),
        (Choice(("a", "b", "c")), 0.34, "b"),
        (Choice(("a", "b", "c")), NEARLY_ONE, "c"),
    ],
)
def test_a_share_of_the_draws_is_below_the_value(searched: Range, share: float, value: Any) -> None:
    assert searched.at(share) == value
    assert type(searched.at(share)) is type(value)


@pytest.mark.parametrize(
    ("searched", "value", "place"),
    [
        (Uniform(-2.0, 0.0), -1.5, 0.25),
        (LogUniform(1e-4, 1e-2), 1e-3, 0.5),
        (Integer(1, 4), 3, 0.625),
        (Integer(2, 7, log=True), 3, math.log(3.5 / 2) / math.log(4)),
        (Choice(("a", "b")), "b", 0.75),
    ],
)
def test_a_value_has_its_place_in_the_range(searched: Range, value: Any, place: float) -> None:
    assert searched.place(value) == pytest.approx(place)
    assert searched.at(place) == value


def test_a_window_around_a_value_holds_a_share_of_the_draws_and_stays_in_the_range() -> None:
    numbers = Uniform(0.0, 10.0)
    assert [numbers.near(4.0, share, 0.2) for share in (0.0, 0.5)] == [3.0, 4.0]
    assert [numbers.near(0.5, share, 0.2) for share in (0.0, 0.5)] == [0.0, 1.0]
    assert [numbers.near(12.0, share, 0.2) for share in (0.0, NEARLY_ONE)] == [8.0, 10.0]
    assert numbers.near(None, 0.7, 0.2) == numbers.at(0.7)
    assert Choice(("a", "b", "c", "d")).near("c", NEARLY_ONE, 1.0) == "d"


@pytest.mark.parametrize("name", method_names())
def test_the_ranges_of_a_method_include_what_profiles_set(name: str) -> None:
    for task in task_names():
        config = resolve(load_method(name), task, "laptop").method
        for key, searched in ranges(config).items():
            value = getattr(config, key)
            assert value is None or 0.0 <= searched.place(value) <= 1.0, (task, key, value)


def test_numbers_have_four_digits() -> None:
    assert Uniform(0.0, 1.0).at(1 / 3) == 0.3333
    assert LogUniform(1e-6, 1.0).at(0.123) == 5.47e-06


def test_a_range_says_what_it_is() -> None:
    assert str(LogUniform(1e-4, 1e-2)) == "0.0001 to 0.01, log"
    assert str(Uniform(-2.0, 0.0)) == "-2 to 0"
    assert str(Integer(1, 32, log=True)) == "integers 1 to 32, log"
    assert str(Choice((0.95, 0.99))) == "one of 0.95, 0.99"


def test_searched_are_the_settings_that_have_a_range_and_an_effect() -> None:
    assert list(ranges(Config())) == ["rate"]
    assert list(ranges(Config(kind="slow"))) == ["rate", "epochs"]
    assert list(ranges(WithoutRate(kind="slow"))) == ["epochs"]


def test_draws_follow_from_the_seed_and_the_name_of_each_setting() -> None:
    searched = ranges(Config(kind="slow"))
    drawn = draw(searched, 5, seed=0)
    assert drawn == draw(searched, 5, seed=0)
    assert drawn != draw(searched, 5, seed=1)
    assert drawn[:3] == draw(searched, 3, seed=0), "more settings leave the first ones as they are"
    alone = draw({"rate": searched["rate"]}, 5, seed=0)
    assert [setting["rate"] for setting in drawn] == [setting["rate"] for setting in alone]
    assert len({setting["rate"] for setting in drawn}) == 5


@pytest.mark.parametrize("name", method_names())
def test_every_draw_of_a_method_is_a_setting_that_it_accepts(name: str) -> None:
    config = resolve(load_method(name), task_names()[0], "laptop").method
    searched = ranges(config)
    ends = [{key: found.at(share) for key, found in searched.items()} for share in (0.0, NEARLY_ONE)]
    for setting in [*draw(searched, 50, seed=1), *ends]:
        accepted = replace(config, **setting)
        assert {key: getattr(accepted, key) for key in setting} == setting


@pytest.mark.parametrize("name", method_names())
def test_a_drawn_value_is_read_back_from_the_command_line_as_it_is(name: str) -> None:
    method_class, task = load_method(name), task_names()[0]
    searched = ranges(resolve(method_class, task, "laptop").method)
    for setting in draw(searched, 5, seed=2):
        texts = [f"{name}.{key}={value}" for key, value in setting.items()]
        config = resolve(method_class, task, "laptop", texts).method
        assert {key: getattr(config, key) for key in setting} == setting
