"""Hyperparameters that cannot be are named with what they could be."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import pytest

from codesign_bench.config.validation import check_values, kinds_of, stored_values
from codesign_bench.config.values import Length, Share, Within
from codesign_bench.method import load_method
from codesign_bench.registry import presented


@dataclass(frozen=True)
class Settings:
    """Hyperparameters of every kind that is checked; as of another package, they do not check themselves."""

    rate: Share | None = 0.5
    widths: Annotated[tuple[Annotated[int, Within(1, 512)], ...], Length(1, 3)] = (8, 8)
    credit: Literal["joint", "separate"] = "joint"
    scale: float = 1.0
    """Says nothing of its limits."""


@pytest.mark.parametrize("rate", [0.0, 1.0, 1, None])
def test_the_ends_of_a_range_belong_to_it_and_none_is_no_number(rate: Any) -> None:
    check_values(Settings(rate=rate))
    if rate is not None:
        beyond = math.nextafter(rate, 2.0 * rate - 0.5)  # away from the middle
        with pytest.raises(ValueError, match="rate must be a number from 0 to 1 or none"):
            check_values(Settings(rate=beyond))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"rate": 1.5}, "rate must be a number from 0 to 1 or none, not 1.5"),
        ({"rate": float("nan")}, "rate must be a number from 0 to 1 or none, not nan"),
        ({"scale": float("inf")}, "scale must be a number, not inf"),
        ({"scale": "1"}, "scale must be a number, not '1'"),
        ({"widths": (8, 0)}, "each an integer from 1 to 512, not (8, 0)"),
        ({"widths": (8, 2.5)}, "each an integer from 1 to 512, not (8, 2.5)"),
        ({"widths": ()}, "widths must be values separated by commas, 1 to 3 of them"),
        ({"widths": (1, 2, 3, 4)}, "widths must be values separated by commas, 1 to 3 of them"),
        ({"credit": "shared"}, "credit must be one of joint, separate, not 'shared'"),
    ],
)
def test_a_value_that_cannot_be_is_named_with_what_could(change: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match="must be") as caught:
        check_values(replace(Settings(), **change))
    assert told in str(caught.value)


def test_values_that_were_stored_under_other_limits_remain_readable() -> None:
    with stored_values():
        check_values(Settings(rate=7.0))
    with pytest.raises(ValueError, match="rate"):
        check_values(Settings(rate=7.0))


@pytest.mark.parametrize("method", presented("methods"))
def test_every_number_among_our_hyperparameters_says_its_limits(method: str) -> None:
    unlimited = [name for name, kind in kinds_of(load_method(method).config_class).items() if kind in (int, float)]
    assert unlimited == []
