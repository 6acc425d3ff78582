"""Compare two results per task and method: `codesign-bench compare A B`.

Differences are A minus B of final values over seeds, with Welch's interval; p-values are adjusted by Holm's method for
all differences in the table. Averages over tasks are a family of their own.

Shapes: `N` and `M` seeds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from codesign_bench import stats
from codesign_bench.cell.variant import DEFAULT_NAME
from codesign_bench.claims.finding import probability
from codesign_bench.claims.statistics import BUDGET_TOLERANCE
from codesign_bench.errors import UserError
from codesign_bench.figures.comparison import made_otherwise
from codesign_bench.sharing.finals import Finals, Scales, finals_of
from codesign_bench.stats import Estimate, Reference
from codesign_bench.storage.places import shown
from codesign_bench.storage.reference_points import stored_references

HEADER = ("task", "method", "seeds", "return A", "return B", "A - B [95 %]", "score A - B [95 %]", "p", "adjusted p")


@dataclass(frozen=True)
class Difference:
    """A method of A and one of B on a task in a variant, or on average over tasks."""

    place: str
    """The task, with its variant unless it is the default, or a number of tasks."""
    methods: tuple[str, str]
    pairs: tuple[tuple[Finals, Finals], ...]
    """Of each task."""
    returns: Estimate
    """Of the return; NaN on average, where it has no meaning."""
    scores: Estimate
    """Of the normalised score; NaN without reference points."""
    p_adjusted: float = math.nan
    family_size: int = 0

    @property
    def p(self) -> float:
        """The p-value of the return's difference, or of the average score's."""
        return self.returns.p if len(self.pairs) == 1 else self.scores.p


@dataclass(frozen=True)
class Comparison:
    """Everything that `compare` finds."""

    first: Path
    second: Path
    differences: list[Difference]
    """One for each method on each task in each variant of both."""
    averages: list[Difference]
    """One for each method with several tasks."""
    alone: list[str]
    """What only one of the two has."""


def compare(first: Path, second: Path, methods: Sequence[str] | None = None, variants: bool = False) -> Comparison:
    """Compare the finished cells of two results folders.

    Args:
        first: A.
        second: B.
        methods: one method that is compared alone, or one of A and one of B; None: all that both have.
        variants: whether variants other than `default` are compared, too.

    Raises:
        UserError: the two have nothing in common that can be compared, or `methods` are more than two.
    """
    if methods is not None and len(methods) > 2:
        raise UserError(f"--method: give one method, or one of A and one of B, not {len(methods)}")
    of_a, of_b = (
        [found for found in finals_of(folder) if variants or found.variant == DEFAULT_NAME]
        for folder in (first, second)
    )
    everything = [(first, of_a), (second, of_b)]
    if methods is not None:
        of_a, of_b = (
            [found for found in side if found.method == method]
            for side, method in ((of_a, methods[0]), (of_b, methods[-1]))
        )
    pairs = [(one, two) for one in of_a for two in of_b if _alike(one, two, same_method=methods is None)]
    if not pairs:
        raise UserError(_nothing_common(everything, variants))
    scales = common_scales(stored_references(first), stored_references(second))
    singles = [_single(pair, scales) for pair in pairs]
    matched = {id(found) for pair in pairs for found in pair}
    alone = {
        name: _described(found for found in side if id(found) not in matched)
        for name, side in (("A", of_a), ("B", of_b))
    }
    remarks = [f"only in {name}: {others}" for name, others in alone.items() if others]
    return Comparison(first, second, adjusted(singles), adjusted(_averages(singles, scales)), remarks)


def common_scales(first: Scales, second: Scales) -> dict[tuple[str, int], Reference]:
    """Return the scale of each task of either side: from idle to the higher of two best known."""
    scales = dict(first)
    for scene, found in second.items():
        own = scales.get(scene, found)
        scales[scene] = Reference(own.zero, max(own.one, found.one))
    return scales


def adjusted(differences: Sequence[Difference]) -> list[Difference]:
    """Return differences with p-values adjusted for all of them."""
    adjusted_p = stats.holm([found.p for found in differences])
    size = sum(not math.isnan(found.p) for found in differences)
    return [
        replace(found, p_adjusted=float(p), family_size=size) for found, p in zip(differences, adjusted_p, strict=True)
    ]


def rows_of(found: Comparison) -> list[tuple[str, ...]]:
    """Return the rows of the table with `HEADER`."""
    return [_row(difference) for difference in (*found.differences, *found.averages)]


def notes(found: Comparison) -> list[str]:
    """Return what a reader of the table should know: what A and B are, and what differs besides the results."""
    names = [shown(folder) for folder in (found.first, found.second)]
    tests = f"{found.differences[0].family_size} tests of the table"
    tests += "; averages are adjusted apart" if found.averages else ""
    return [
        f"A is {names[0]}, B is {names[1]}; differences are A - B with Welch's interval over seeds, "
        f"p adjusted by Holm's method for {tests}",
        *_budgets(found.differences),
        *found.alone,
        *made_otherwise(found.first, found.second),
    ]


def interval(found: Estimate) -> str:
    """Return an estimate with its interval as text."""
    if math.isnan(found.value):
        return "-"
    ends = "" if math.isnan(found.low) else f" [{found.low:+.2f}, {found.high:+.2f}]"
    return f"{found.value:+.2f}{ends}"


def _alike(one: Finals, two: Finals, *, same_method: bool) -> bool:
    """Return whether two final values may be compared."""
    same = (one.scene, one.variant) == (two.scene, two.variant)
    return same and (one.method == two.method or not same_method)


def _single(pair: tuple[Finals, Finals], scales: Scales) -> Difference:
    one, two = pair
    place = one.scene[0] if one.variant == DEFAULT_NAME else f"{one.scene[0]} {one.variant}"
    returns = stats.welch(one.returns, two.returns)
    scores = stats.welch(one.scores(scales), two.scores(scales))
    return Difference(place, (one.method, two.method), (pair,), returns, scores)


def _averages(singles: Iterable[Difference], scales: Scales) -> list[Difference]:
    """Return the averages over tasks of methods that have scores in the default variant on several."""
    groups: dict[tuple[str, str], list[tuple[Finals, Finals]]] = {}
    for single in singles:
        if single.pairs[0][0].variant == DEFAULT_NAME and not math.isnan(single.scores.value):
            groups.setdefault(single.methods, []).append(single.pairs[0])
    return [
        Difference(
            f"average of {len(pairs)} tasks",
            methods,
            tuple(pairs),
            Estimate(math.nan),
            stats.welch_across([(one.scores(scales), two.scores(scales)) for one, two in pairs]),
        )
        for methods, pairs in groups.items()
        if len(pairs) > 1
    ]


def _row(found: Difference) -> tuple[str, ...]:
    single = len(found.pairs) == 1
    one, two = found.pairs[0]
    return (
        found.place,
        found.methods[0] if len(set(found.methods)) == 1 else " - ".join(found.methods),
        f"{len(one.returns)}, {len(two.returns)}" if single else "",
        f"{one.returns.mean():.2f}" if single else "",
        f"{two.returns.mean():.2f}" if single else "",
        interval(found.returns),
        interval(found.scores),
        "" if math.isnan(found.p) else probability(found.p),
        "" if math.isnan(found.p) else f"{probability(found.p_adjusted)} ({found.family_size})",
    )


def _budgets(differences: Iterable[Difference]) -> list[str]:
    """Return a line for each pair whose cells were trained for different numbers of steps."""
    lines = []
    for found in differences:
        steps = [side.env_steps for side in found.pairs[0]]
        if max(steps) > (1.0 + BUDGET_TOLERANCE) * min(steps):
            counts = " and ".join(f"{count:,.0f}" for count in steps)
            lines.append(f"budgets differ on {found.place}, {found.methods[0]}: {counts} environment steps")
    return lines


def _nothing_common(comparison: Sequence[tuple[Path, Sequence[Finals]]], variants: bool) -> str:
    has = (f"{shown(folder)} has {_described(found) or 'no finished cell to compare'}" for folder, found in comparison)
    more = "" if variants else ", or other variants with --variants"
    return (
        "no task, version, variant and method are in both; compare two methods with --method M_OF_A M_OF_B"
        f"{more}\n{'; '.join(has)}"
    )


def _described(group: Iterable[Finals]) -> str:
    """Return which methods there are of each task and variant: "a, b on push (version 1)"."""
    methods: dict[str, list[str]] = {}
    for found in group:
        variant = "" if found.variant == DEFAULT_NAME else f" {found.variant}"
        methods.setdefault(f"{found.scene[0]}{variant} (version {found.scene[1]})", []).append(found.method)
    places: dict[str, list[str]] = {}
    for place, names in methods.items():
        places.setdefault(", ".join(names), []).append(place)
    return "; ".join(f"{names} on {', '.join(found)}" for names, found in places.items())
