"""The manifest of an archive: it is read as it was written, and another content is refused."""

from __future__ import annotations

import json
from typing import Any

import pytest

from codesign_bench.storage.manifest import LONGEST_NOTE, Manifest, StoredFile

CURVE = "push/gnn_ppo/default/seed-00/curve.csv"


def test_a_manifest_is_read_as_it_was_written() -> None:
    manifest = Manifest(
        title="a",
        by="b",
        note="c",
        ended="2026-01-01",
        cells=2,
        policies=1,
        packed_by={"commit": "d"},
        code=({"commit": "e", "cells": 2},),
        versions={"numpy": {"2.0": 2}},
        tuning_note="f",
        tuning_steps={"push": {"cma_es": 7}},
        files={CURVE: StoredFile(3, "0f")},
    )
    assert Manifest.from_json(json.loads(json.dumps(manifest.to_json()))) == manifest


@pytest.mark.parametrize(
    "change",
    [
        {"schema": 0},
        {"content": "something else"},
        {"code": "a commit"},
        {"cells": -1},
        {"note": "x" * (LONGEST_NOTE + 1)},
        {"files": {CURVE: {"bytes": "many", "sha256": "0f"}}},
        {"tuning": {"env_steps": {"push": {"cma_es": 0.5}}}},
    ],
)
def test_another_content_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises((ValueError, KeyError, TypeError, AttributeError)):
        Manifest.from_json({**Manifest().to_json(), **change})
