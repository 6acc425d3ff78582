"""The study of the tutorial runs, is drawn and is judged, with its files alone."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"


def codesign_bench(*arguments: str) -> str:
    """Run a command in the folder of the examples and return what it prints."""
    command = [sys.executable, "-m", "codesign_bench", *arguments, "--import", "practice"]
    done = subprocess.run(command, cwd=EXAMPLES, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_study_of_the_tutorial_runs_is_drawn_and_is_judged(tmp_path: Path) -> None:
    runs, figures = str(tmp_path / "runs"), str(tmp_path / "figures")
    cells = ("--task", "catch_balls", "--method", "cma_es", "--variant", "practice=1,16", "--seeds", "100-102")
    codesign_bench("run", *cells, "--profile", "quick", "--steps", "6000", "--out", runs)
    codesign_bench(
        *("plot", "practice_curves", "--import", "practice_curves", "--study", "practice"),
        *("--results", runs, "--out", figures),
    )
    assert (tmp_path / "figures" / "practice_curves.png").stat().st_size > 0
    codesign_bench("verify", "--study", "practice", "--results", runs, "--out", str(tmp_path / "claims"))
    (claim,) = json.loads((tmp_path / "claims" / "claims.json").read_text())["claims"]
    assert claim["n"].startswith("1 task"), "it was judged on the cells, not left for lack of data"
