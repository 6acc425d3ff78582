"""Fixtures that several tests share, and the choice of members whose promises are tested."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from codesign_bench import plugins, registry
from codesign_bench.sweep.training import CHECKPOINT_SECONDS_VARIABLE
from toy import GATE_VARIABLE, Gate

TESTS = Path(__file__).parent
LONGEST = [
    TESTS / name
    for name in ("test_third_party.py", "results/test_reference.py", "results/test_policies.py", "sweep/test_resume.py")
]
"""Files that begin, so that of several processes none waits for another in the end."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--members`."""
    parser.addoption(
        "--members", metavar="NAMES", help="only what is promised of these tasks, methods, figures, studies"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with the longest files; leave out all tests but those parametrised by a name of `--members`, if given."""
    items.sort(key=lambda item: item.path not in LONGEST)
    if config.getoption("--members") is None:
        return
    wanted = set(config.getoption("--members").split(","))
    chosen = [item for item in items if isinstance(item, pytest.Function) and wanted & set(parameters(item))]
    config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
    items[:] = chosen


def parameters(item: pytest.Function) -> list[str]:
    """Return the text values by which a test is parametrised."""
    values = item.callspec.params.values() if hasattr(item, "callspec") else ()
    return [value for value in values if isinstance(value, str)]


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make `toy_reach` and `toy_search` known here and in the processes started from here."""
    monkeypatch.syspath_prepend(str(TESTS))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")]).strip(os.pathsep))
    monkeypatch.setenv(registry.IMPORTS_VARIABLE, "")
    monkeypatch.setattr(registry, "_registered", {})
    plugins.import_modules(["toy"])


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a folder that is searched for modules, which are forgotten afterwards."""
    known = set(sys.modules)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in set(sys.modules) - known:
        if str(getattr(sys.modules[name], "__file__", None) or "").startswith(str(tmp_path)):
            del sys.modules[name]


@pytest.fixture
def gate(toy: None, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Gate:
    """A gate for the cells that are started from here; open at first."""
    path = tmp_path_factory.mktemp("gate") / "steps"
    monkeypatch.setenv(GATE_VARIABLE, str(path))
    return Gate(path)


@pytest.fixture
def every_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a checkpoint after every batch."""
    monkeypatch.setenv(CHECKPOINT_SECONDS_VARIABLE, "0")
