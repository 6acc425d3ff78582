"""Do two results decide the claims of a study alike? So machines, budgets and versions of scenes are compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codesign_bench import __version__
from codesign_bench.claims.claim import Claim
from codesign_bench.claims.judging import Row
from codesign_bench.claims.page import STATISTIC, Claimant, entry
from codesign_bench.storage import provenance
from codesign_bench.storage.places import shown
from codesign_bench.text_tables import markdown, plain_markdown
from codesign_bench.visible_text import on_one_line

SAME, HERE_ONLY, THERE_ONLY, OPPOSITE, OTHERWISE = "same", "decided here", "decided there", "opposite", "other verdict"
ANSWERS = (OPPOSITE, HERE_ONLY, THERE_ONLY, OTHERWISE, SAME)
"""How two verdicts go together, in the order of the table."""
HEADER = (
    "claim",
    "agreement",
    *(f"{what} {where}" for what in ("verdict", STATISTIC, "n") for where in ("here", "there")),
)
HOW_SURE = (
    "Two studies of the same truth often decide differently where effects are small: one decided and the other "
    "undecided is no contradiction. *Opposite* verdicts are."
)


@dataclass(frozen=True)
class Pair:
    """A claim as two results answer it."""

    here: Row
    there: Row

    @property
    def claim(self) -> Claim:
        """The claim."""
        return self.here.claim

    @property
    def agreement(self) -> str:
        """One of `ANSWERS`."""
        here, there = self.here.finding, self.there.finding
        if here.verdict == there.verdict:
            return SAME
        if here.is_directional and there.is_directional:
            return OPPOSITE
        if here.is_directional:
            return HERE_ONLY
        return THERE_ONLY if there.is_directional else OTHERWISE

    @property
    def texts(self) -> tuple[str, ...]:
        """One cell of the table for each name in `HEADER`."""
        both = self.here, self.there
        return (
            self.claim.name,
            self.agreement,
            *(row.finding.verdict for row in both),
            *(row.interval for row in both),
            *(row.finding.n for row in both),
        )


def pairs(here: Sequence[Row], there: Sequence[Row]) -> list[Pair]:
    """Return the claims that both results have data for, opposite verdicts first and equal ones last."""
    others = {row.claim.name: row for row in there if _has_data(row)}
    found = [Pair(row, others[row.claim.name]) for row in here if _has_data(row) and row.claim.name in others]
    return sorted(found, key=lambda pair: ANSWERS.index(pair.agreement))


def _has_data(row: Row) -> bool:
    return row.asked and not row.needs


def summary(found: Sequence[Pair]) -> str:
    """Return in a line how often verdicts agree."""
    counts = Counter(pair.agreement for pair in found)
    return f"{len(found)} claims with data in both: " + ", ".join(f"{counts[answer]} {answer}" for answer in ANSWERS)


def as_markdown(found: Sequence[Pair], study: Claimant, here: Path, there: Path, made: Sequence[str] = ()) -> str:
    """Return the page: the counts, every claim that both results have data for, and how cells were made otherwise."""
    names = f"Here is `{on_one_line(shown(here))}`, there is `{on_one_line(shown(there))}`."
    parts = [
        f"# {study.title}: verdicts of two results\n",
        f"{names} {plain_markdown(summary(found))}. {HOW_SURE}\n",
        markdown(HEADER, [pair.texts for pair in found]),
    ]
    if made:
        parts += ["## How the cells were made\n", provenance.as_markdown(made)]
    return "\n".join(parts)


def as_json(
    found: Sequence[Pair], study: Claimant, here: Path, there: Path, made: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the same as JSON values, each claim with all that is known of it in both."""
    return {
        "version": __version__,
        "study": study.name,
        "here": shown(here),
        "there": shown(there),
        "made": list(made),
        "claims": [
            {
                "name": pair.claim.name,
                "agreement": pair.agreement,
                "here": entry(pair.here),
                "there": entry(pair.there),
            }
            for pair in found
        ],
    }
