"""Grids of cells: tasks x seeds x variants x methods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

from codesign_bench.cell.axes import axis_named
from codesign_bench.cell.cell import Cell
from codesign_bench.cell.variant import DEFAULT, Value, Variant
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.errors import UserError


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
    """Yield every cell; all methods of a seed come before the next seed, so that a partial sweep has every method."""
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
            group.extend((axis, meaning.kind(value)) for value in dict.fromkeys(chosen))
    return [Variant.of(**dict(combination)) for combination in product(*groups.values())]


def parse_seeds(text: str) -> tuple[int, ...]:
    """Parse `--seeds`: `6` is 0 to 5, `0,3,5` a list, `2-4` a range.

    Raises:
        UserError: it has none of these forms, or is empty or negative.
    """
    try:
        if text.strip().isdigit():
            seeds = list(range(int(text)))
        else:
            seeds = [seed for part in text.split(",") for seed in _seed_range(part)]
    except ValueError:
        seeds = []
    if not seeds:
        raise UserError(f"--seeds: '{text}' is neither a count (6 is 0-5) nor a list (0,3,5) nor a range (2-4)")
    return tuple(dict.fromkeys(seeds))


def _seed_range(part: str) -> range:
    first, dash, last = part.partition("-")
    return range(int(first), int(last if dash else first) + 1)
