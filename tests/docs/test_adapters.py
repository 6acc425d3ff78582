"""The learners on the page about other libraries run as written, but for their budgets."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "adapters.md"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
BUDGET, TINY = "= 64, 160, 300_000\n", "= 2, 160, 320\n"


@pytest.mark.parametrize("library", ["stable_baselines3", "torchrl"])
def test_examples_run(library: str, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip(library)
    (example,) = (text for text in BLOCK.findall(PAGE.read_text(encoding="utf-8")) if f"from {library}" in text)
    assert BUDGET in example
    exec(compile(example.replace(BUDGET, TINY), f"{PAGE.name}, {library}", "exec"), {"__name__": "__main__"})
    assert re.search(r"^solved \d+ of 128 evaluation instances$", capsys.readouterr().out, re.MULTILINE)
