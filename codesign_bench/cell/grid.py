"""Grids of cells: tasks x seeds x variants x methods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import prod
from typing import Annotated, TypeAlias

from codesign_bench.cell.axes import axis_named
from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import DEFAULT, Value, Variant
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.values import Within, parse_value, plain_type, shown
from codesign_bench.errors import UserError

MOST_SEEDS, MOST_CELLS = 10_000, 100_000
Count: TypeAlias = Annotated[int, Within(1, MOST_SEEDS)]
"""How many seeds."""
Seed: TypeAlias = Annotated[int, Within(0, 2**32 - 1)]


def grid(
    *,
    tasks: Sequence[str],
    methods: Sequence[str],
    seeds: Sequence[int],
    variants: Sequence[Variant] = (DEFAULT,),
    profile: str = DEFAULT_PROFILE,
    steps: int | None = None,
    overrides: Sequence[str] = (),
) -> Iterator[Cell]:
    """Yield every cell; all methods of a seed come before the next seed, so that a partial sweep has every method.

    Raises:
        UserError: there are more than `MOST_CELLS`.
    """
    count = prod(map(len, (tasks, seeds, variants, methods)))
    if count > MOST_CELLS:
        raise UserError(f"{count:,} cells are too many for one sweep; run at most {MOST_CELLS:,} at a time")
    for task, seed, variant, method in product(tasks, seeds, variants, methods):
        yield Cell(task, method, seed, variant, profile, steps, tuple(overrides))


def variants_of(values: Mapping[str, Sequence[Value]]) -> list[Variant]:
    """Return every combination of values on axes; axes that exclude each other are varied separately.

    Args:
        values: axis -> its values; an axis without values is not varied.
    """
    groups: dict[str, list[tuple[str, Value]]] = {}
    for axis, chosen in values.items():
        if chosen:
            meaning = axis_named(axis)
            group = groups.setdefault(meaning.exclusive or axis, [])
            group.extend((axis, plain_type(meaning.kind)(value)) for value in dict.fromkeys(chosen))
    return [Variant.of(**dict(combination)) for combination in product(*groups.values())]


def parse_seeds(text: str) -> tuple[int, ...]:
    """Parse `--seeds`: `6` is 0 to 5, `0,3,5` a list, `2-4` a range.

    Raises:
        UserError: it has none of these forms, is empty or negative, or there are too many.
    """
    parts = [text] if text.strip().isdigit() else text.split(",")
    seeds: dict[int, None] = {}
    try:
        for part in parts:
            chosen = range(parse_value(Count, text)) if parts == [text] and "-" not in text else _seed_range(part)
            seeds.update(dict.fromkeys(chosen))
            if not chosen or len(seeds) > MOST_SEEDS:
                raise ValueError
    except ValueError:
        forms = f"neither a count (6 is 0-5) nor a list (0,3,5) nor a range (2-4) of at most {MOST_SEEDS:,} seeds"
        raise UserError(f"--seeds: {shown(text)} is {forms}") from None
    return tuple(seeds)


def _seed_range(part: str) -> range:
    first, dash, last = part.partition("-")
    seeds = range(parse_value(Seed, first), parse_value(Seed, last if dash else first) + 1)
    if len(seeds) > MOST_SEEDS:
        raise ValueError
    return seeds
