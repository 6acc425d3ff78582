"""What tests of the report share: cells with all that a page tells of, and a reader of pages."""

from __future__ import annotations

from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from builders import rising, store_cell
from codesign_bench.config.settings import Sourced, StoredConfig
from codesign_bench.report.page import write_report
from codesign_bench.storage.records import Timings

ATTACK = "<script>alert('x')</script><img src=http://example.com/x onerror=alert(1)>"
TASK = "reach"
VOID = {"meta", "img", "link", "br", "hr", "input"}


def config(epochs: int = 4, source: str = "default", **method: Sourced) -> StoredConfig:
    """Return a configuration of 1,000 steps."""
    return StoredConfig({"steps": Sourced(1000, "default")}, {"epochs": Sourced(epochs, source), **method})


def make_cell(out: Path, seed: int, *, returns: Sequence[float] = (), **changes: Any) -> Path:
    """Write a cell that was evaluated to `returns` every 100 steps, and to a success rate of a tenth of that."""
    facts = {
        "task": TASK,
        "label": "Ours",
        "env_steps": 100 * (len(returns) - 1) if returns else 0,
        "config": config(),
        "versions": {"python": "3.11.7", "torch": "2.13.0"},
        "host": {"name": "desk", "system": "Linux", "cpu": "some CPU", "cores": 2, "threads": 1},
        "timings": Timings(started="2026-01-02T03:04:05+00:00", train_s=50.0, evaluate_s=2.0, wall_s=60.0),
    }
    curve = [{**row, "success_rate": row["return_mean"] / 10} for row in rising(*returns)]
    return store_cell(out, seed=seed, curve=curve, **{**facts, **changes})


class Reader(HTMLParser):
    """Reads a page as a browser would: its elements, addresses and text; fails where elements do not close."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[str] = []
        self.addresses: list[str] = []
        self.names: set[str] = set()
        self.identities: list[str] = []
        self.text = ""
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the element."""
        self.elements.append(tag)
        self.open += [] if tag in VOID else [tag]
        self.names |= {name for name, _ in attrs}
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "action")]
        self.identities += [value or "" for name, value in attrs if name == "id"]

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element that closes itself."""
        self.elements.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Close the element, which must be the last that was opened."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Collect text."""
        self.text += data


def report(results: Path) -> str:
    """Return the page on `results`."""
    out = results.parent / "page" / "report.html"
    write_report(results, out, [].append)
    return out.read_text(encoding="utf-8")
