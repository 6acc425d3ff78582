"""docs/claims.md tells the rules of every study of this project."""

from __future__ import annotations

import pkgutil
import re
from pathlib import Path

import pytest

from codesign_bench import studies
from codesign_bench.study import load_study

PAGE = Path(__file__).resolve().parents[2] / "docs" / "claims.md"


@pytest.mark.parametrize("name", [module.name for module in pkgutil.iter_modules(studies.__path__)])
def test_the_page_tells_every_rule_in_the_same_words(name: str) -> None:
    told = set(re.findall(r"^\| (.+) \| (.+) \| (.+) \|$", PAGE.read_text(), re.MULTILINE))
    assert {(claim.rule.kind, claim.rule.statistic, claim.rule.words) for claim in load_study(name).claims()} <= told
