"""Fixtures that the tests of the explorer share."""

from __future__ import annotations

from pathlib import Path

import pytest

from explorer_pages import write_page


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a page on four methods' policies on push."""
    path = tmp_path_factory.mktemp("explorer") / "explorer.html"
    write_page(path)
    return path
