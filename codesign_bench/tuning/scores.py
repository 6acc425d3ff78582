"""Scores of settings: the mean over tuning seeds of the return on validation instances at the end of training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan, nan
from pathlib import Path

import pandas as pd

from codesign_bench.cell.cell import Cell
from codesign_bench.storage.cells import StoredCell
from codesign_bench.storage.records import CellRecord
from codesign_bench.tuning.settings import Setting


@dataclass(frozen=True)
class Score:
    """What a setting reached in a rung."""

    setting: Setting
    rung: int
    steps: int
    """Budget of each of its cells."""
    env_steps: int
    """Environment steps of all of its cells together."""
    validation_return: float
    """NaN if one of its cells failed."""

    @property
    def failed(self) -> bool:
        """Whether one of its cells failed; the setting then goes no further."""
        return isnan(self.validation_return)


def score(setting: Setting, rung: int, cells: Sequence[Cell], out: Path) -> Score:
    """Return the score of a setting from its cells in the results folder `out`; all of them have ended."""
    ended = [_ended(cell.folder(out)) for cell in cells]
    return Score(
        setting=setting,
        rung=rung,
        steps=cells[0].steps or 0,
        env_steps=sum(env_steps for env_steps, _ in ended),
        validation_return=sum(value for _, value in ended) / len(ended),
    )


def _ended(folder: Path) -> tuple[int, float]:
    """Return a cell's environment steps and its final return, NaN if it failed or its curve cannot be used."""
    record = CellRecord.read(folder)
    if record is None:  # its process died before it could record anything
        return 0, nan
    cell = StoredCell(folder, record)
    return record.env_steps, cell.last_evaluation().get("return_mean", nan) if cell.is_done else nan


def best(scores: Sequence[Score], count: int) -> list[Score]:
    """Return the `count` best scores, best first; of equal ones the setting drawn first, and those with NaN last."""

    def place(found: Score) -> tuple[bool, float, int]:
        return found.failed, 0.0 if found.failed else -found.validation_return, found.setting.number

    return sorted(scores, key=place)[:count]


def pooled(scores: Sequence[Score], count: int) -> list[Score]:
    """Return the scores of the `count` best settings of every method over all tasks, in the given order.

    Settings of one method with the same number are one change on all tasks. Their returns differ in scale between
    tasks, so their ranks are averaged; of equal means the first setting is better. A setting with a failed cell is left
    out everywhere.
    """
    chosen: set[tuple[str, int]] = set()
    for method in dict.fromkeys(found.setting.method for found in scores):
        of_method = [found for found in scores if found.setting.method == method]
        failed = {found.setting.number for found in of_method if found.failed}
        returns: dict[int, dict[str, float]] = {}
        for found in of_method:
            if found.setting.number not in failed:
                returns.setdefault(found.setting.number, {})[found.setting.task] = found.validation_return
        ranks = mean_ranks(pd.DataFrame(returns))
        order = sorted(ranks.items(), key=lambda place: (place[1], place[0]))
        chosen |= {(method, number) for number, _ in order[:count]}
    return [found for found in scores if (found.setting.method, found.setting.number) in chosen]


def mean_ranks(returns: pd.DataFrame) -> dict[int, float]:
    """Return each setting's rank averaged over tasks; the highest return is 1, equal ones share their mean rank.

    Args:
        returns: a row for every task and a column for every setting, by its number.
    """
    ranks = returns.rank(axis="columns", ascending=False).mean()
    return {int(number): rank for number, rank in zip(returns.columns, ranks.tolist(), strict=True)}


def confirmed(winners: Sequence[Score], scores: Sequence[Score], ahead_on: int) -> list[Score]:
    """Return the winners of a pooled search, or a method's present settings where its winner is not clearly better.

    The best of several equal changes has the best mean rank more often than not, so a high rank is not enough.

    Args:
        winners: one setting of each method on every task.
        scores: all scores of the last rung, in which setting 0 is the present one.
        ahead_on: tasks on which a winner must have the higher return. Where the present settings failed, on some task,
            the winner stays.
    """
    present = {(found.setting.method, found.setting.task): found for found in scores if found.setting.number == 0}
    chosen = []
    for method in dict.fromkeys(winner.setting.method for winner in winners):
        pairs = [(won, present[method, won.setting.task]) for won in winners if won.setting.method == method]
        ahead = sum(won.validation_return > before.validation_return for won, before in pairs)
        stays = ahead < ahead_on and not any(before.failed for _, before in pairs)
        chosen += [before if stays else won for won, before in pairs]
    return chosen


def survivors(scores: Sequence[Score], count: int) -> list[Score]:
    """Return the `count` best scores of every method on every task, in the given order; failed ones are left out."""
    groups: dict[tuple[str, str], list[Score]] = {}
    for found in scores:
        groups.setdefault((found.setting.task, found.setting.method), []).append(found)
    chosen = {id(found) for group in groups.values() for found in best(group, count)}
    return [found for found in scores if id(found) in chosen and not found.failed]
