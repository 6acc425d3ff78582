"""The leaderboard: every method of every archive that was submitted, by normalised score, as Markdown tables.

The scale of every score is that of the maintainers' own archive, `OWN`: from a random tool held still (0) to the best
that is known (1), so that no submission moves the scale by what it says of itself.

Shapes: `N` seeds.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from codesign_bench.cell.variant import DEFAULT_NAME
from codesign_bench.errors import UserError
from codesign_bench.registry import in_order
from codesign_bench.sharing.finals import Finals, Scales, finals_of
from codesign_bench.stats import MIN_SEEDS, Estimate, mean_across, mean_t_interval
from codesign_bench.storage.archive import SUFFIX, read_manifest
from codesign_bench.storage.manifest import Manifest
from codesign_bench.storage.places import unpacked
from codesign_bench.storage.provenance import NOT_RECORDED, SHORT
from codesign_bench.storage.reference_points import stored_references
from codesign_bench.text_tables import markdown
from codesign_bench.visible_text import on_one_line

OWN = "codesign-bench"
"""The maintainers' archive, without the ending; it comes first and gives the scale."""
NOT_STATED, STATED, NOTHING = "not stated", "in words below", "-"
DAY = len("2026-01-01")
NAME = re.compile(r"[A-Za-z0-9._-]+")
PLACE, METHOD, ARCHIVE, SEEDS, SCORE = "place", "method", "archive", "seeds", "score"
STEPS, TUNING = "steps a cell", "tuning steps"
SUMMARY = (PLACE, METHOD, ARCHIVE, SEEDS, SCORE, STEPS, TUNING)
OF_A_TASK = (PLACE, METHOD, ARCHIVE, SEEDS, SCORE, "return", "success", STEPS, TUNING)
ARCHIVES = (ARCHIVE, "title", "by", "cells", "policies", "last cell", "commits (cells)", "tuning", "note")


@dataclass(frozen=True)
class Submission:
    """An archive: what it says of itself, and its final values in the default variant."""

    name: str
    """The file's name without its ending."""
    manifest: Manifest
    finals: list[Finals]

    def tuning(self, found: Finals) -> int | None:
        """Return the environment steps of tuning a method on a task; None: they are not known."""
        return self.manifest.tuning_steps.get(found.scene[0], {}).get(found.method)


@dataclass(frozen=True)
class Line:
    """A method of a submission, on one task or on all."""

    submission: Submission
    finals: tuple[Finals, ...]
    score: Estimate

    @property
    def seeds(self) -> int:
        """The fewest seeds on a task."""
        return min(len(found.returns) for found in self.finals)

    @property
    def order(self) -> tuple[bool, float]:
        """Lines are sorted by this: those with enough seeds first, the highest score first."""
        return self.seeds < MIN_SEEDS, -self.score.value if not math.isnan(self.score.value) else math.inf


def submissions(folder: Path) -> tuple[list[Submission], Scales]:
    """Return every archive in a folder, the maintainers' own first, and the scale of every task.

    Raises:
        UnusableFile: an archive is damaged.
        UserError: the maintainers' archive is missing.
    """
    paths = _archives(folder)
    if not paths or paths[0].stem != OWN:
        raise UserError(f"no {OWN}{SUFFIX} in '{folder}', which gives the scale of all scores")
    found = []
    for path in paths:
        finals = [final for final in finals_of(unpacked(path)) if final.variant == DEFAULT_NAME]
        found.append(Submission(path.stem, read_manifest(path), finals))
    return found, stored_references(unpacked(paths[0]))


def leaderboard(folder: Path, link: str) -> str:
    """Return the leaderboard of the archives in a folder as Markdown: all tasks, each task, and the archives.

    Args:
        folder: holds the archives.
        link: where a link of the page finds the folder.

    Raises:
        UserError: as `submissions` does.
    """
    found, scales = submissions(folder)
    parts = [
        *_over_all_tasks(found, scales),
        *(_of_a_task(scene, found, scales) for scene in _scenes(found)),
        f"## Archives\n\n{markdown(ARCHIVES, [_about(submission) for submission in found])}",
        "\n".join(f"- [{path.name}]({link}/{path.name})" for path in _archives(folder)),
    ]
    return "\n".join(parts) + "\n"


def _archives(folder: Path) -> list[Path]:
    """Return the archives in a folder, the maintainers' own first.

    Raises:
        UserError: the name of one could not be in a link.
    """
    paths = sorted(folder.glob(f"*{SUFFIX}"), key=lambda path: (path.stem != OWN, path.stem))
    for path in paths:
        if not NAME.fullmatch(path.name):
            raise UserError(f"'{on_one_line(str(path))}': name an archive by letters, digits, '.', '-' and '_' alone")
    return paths


def _scenes(found: Iterable[Submission]) -> list[tuple[str, int]]:
    """Return every task and version, tasks in order, the newest version first."""
    scenes = {final.scene for submission in found for final in submission.finals}
    tasks = in_order("tasks", (task for task, _ in scenes))
    return sorted(scenes, key=lambda scene: (tasks.index(scene[0]), -scene[1]))


def _over_all_tasks(found: Sequence[Submission], scales: Scales) -> list[str]:
    """Return a table for each set of scenes on which a submission has all tasks that have a scale."""
    tasks = in_order("tasks", (task for task, _ in scales))
    groups: dict[tuple[tuple[str, int], ...], list[Line]] = {}
    for submission in found:
        for method in dict.fromkeys(final.method for final in submission.finals):
            own = {final.scene: final for final in submission.finals if final.method == method}
            scenes = _complete(own, tasks, scales)
            if scenes:
                finals = tuple(own[scene] for scene in scenes)
                score = mean_across([final.scores(scales) for final in finals])
                groups.setdefault(scenes, []).append(Line(submission, finals, score))
    newest = sorted(groups, key=lambda scenes: -sum(version for _, version in scenes))
    return [
        f"## All {len(scenes)} tasks\n\n{_versions(scenes)}\n\n{markdown(SUMMARY, _rows(groups[scenes], _summary_row))}"
        for scenes in newest
    ]


def _complete(
    own: Mapping[tuple[str, int], Finals], tasks: Sequence[str], scales: Scales
) -> tuple[tuple[str, int], ...]:
    """Return the newest scene of every task, or nothing if a task is missing or has no scale."""
    scenes = []
    for task in tasks:
        versions = [version for name, version in own if name == task and (name, version) in scales]
        if not versions:
            return ()
        scenes.append((task, max(versions)))
    return tuple(scenes)


def _versions(scenes: Iterable[tuple[str, int]]) -> str:
    return f"Mean over {', '.join(f'{task} (version {version})' for task, version in scenes)}."


def _of_a_task(scene: tuple[str, int], found: Iterable[Submission], scales: Scales) -> str:
    """Return the table of one task."""
    lines = [
        Line(submission, (final,), _score(final, scales))
        for submission in found
        for final in submission.finals
        if final.scene == scene
    ]
    return f"## {scene[0]}, version {scene[1]}\n\n{markdown(OF_A_TASK, _rows(lines, _task_row))}"


def _score(final: Finals, scales: Scales) -> Estimate:
    scores = final.scores(scales)
    return Estimate(float(scores.mean()), *mean_t_interval(scores))


def _rows(lines: Iterable[Line], cells: Callable[[Line], Sequence[str]]) -> list[tuple[str, ...]]:
    """Return the rows of a table; a method with too few seeds or without a score has no place."""
    rows = []
    for place, line in enumerate(sorted(lines, key=lambda line: line.order), start=1):
        ranked = line.seeds >= MIN_SEEDS and not math.isnan(line.score.value)
        rows.append((str(place) if ranked else NOTHING, *cells(line)))
    return rows


def _summary_row(line: Line) -> tuple[str, ...]:
    return (*_named(line), _interval(line.score), *_budgets(line))


def _task_row(line: Line) -> tuple[str, ...]:
    (final,) = line.finals
    means = (f"{final.returns.mean():.2f}", f"{final.successes.mean():.2f}")
    return (*_named(line), _interval(line.score), *means, *_budgets(line))


def _named(line: Line) -> tuple[str, ...]:
    return line.finals[0].label, line.submission.name, str(line.seeds)


def _budgets(line: Line) -> tuple[str, str]:
    """Return the environment steps of a cell, mean over tasks and seeds, and of tuning, summed over tasks."""
    cell = np.mean([final.env_steps for final in line.finals])
    spent = [line.submission.tuning(final) for final in line.finals]
    known = [steps for steps in spent if steps is not None]
    in_words = STATED if line.submission.manifest.tuning_note else NOT_STATED
    return f"{cell:,.0f}", f"{sum(known):,}" if len(known) == len(spent) else in_words


def _interval(found: Estimate) -> str:
    if math.isnan(found.value):
        return NOTHING
    return f"{found.value:.2f}" + ("" if math.isnan(found.low) else f" [{found.low:.2f}, {found.high:.2f}]")


def _about(submission: Submission) -> tuple[str, ...]:
    """Return the row of an archive."""
    manifest = submission.manifest
    commits = [f"{(code.get('commit') or NOT_RECORDED)[:SHORT]} ({code.get('cells')})" for code in manifest.code]
    return (
        submission.name,
        manifest.title or NOTHING,
        manifest.by or NOTHING,
        str(manifest.cells),
        str(manifest.policies),
        manifest.ended[:DAY] or NOTHING,
        ", ".join(commits),
        manifest.tuning_note or NOTHING,
        manifest.note or NOTHING,
    )
