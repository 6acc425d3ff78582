"""Fixtures that several tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

from codesign_bench import plugins, registry
from codesign_bench.sweep.training import CHECKPOINT_SECONDS_VARIABLE

TESTS = Path(__file__).parent


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make `toy_reach` and `toy_search` known here and in the processes started from here."""
    monkeypatch.syspath_prepend(str(TESTS))
    monkeypatch.setenv("PYTHONPATH", str(TESTS))
    monkeypatch.setenv(registry.IMPORTS_VARIABLE, "")
    monkeypatch.setattr(registry, "_registered", {})
    plugins.import_modules(["toy"])


@pytest.fixture
def every_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a checkpoint after every batch."""
    monkeypatch.setenv(CHECKPOINT_SECONDS_VARIABLE, "0")
