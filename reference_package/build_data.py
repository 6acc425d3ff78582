"""Build the package of reference results: setuptools, after the results of the checkout were put into the package.

Only the standard library and setuptools are used, because a build does not have codesign-bench. In a source archive the
results are in the package already. What goes along is what `codesign-bench pack` takes: cells and what was
measured beside them, no figures and verdicts, which are made of these.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from setuptools import build_meta

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent / "results" / "reference"
TARGET = HERE / "codesign_bench_reference" / "reference"
LEFT_OUT = ("figures", "claims", "*.md", ".*", "*.lock", "*.pdf", "*.png", "*.gif")
ARCHIVE_FILE = "archive.json"
"""The manifest, as `codesign_bench.storage.archive` reads it."""

get_requires_for_build_wheel = build_meta.get_requires_for_build_wheel
get_requires_for_build_sdist = build_meta.get_requires_for_build_sdist
prepare_metadata_for_build_wheel = build_meta.prepare_metadata_for_build_wheel


def build_wheel(folder: str, settings: Mapping[str, Any] | None = None, metadata: str | None = None) -> str:
    """Build the wheel into `folder` and return its name."""
    put_results_into_package()
    return build_meta.build_wheel(folder, settings, metadata)


def build_sdist(folder: str, settings: Mapping[str, Any] | None = None) -> str:
    """Build the source archive into `folder` and return its name."""
    put_results_into_package()
    return build_meta.build_sdist(folder, settings)


def put_results_into_package() -> None:
    """Copy the results of the checkout, if there is one, over those in the package, and write the manifest.

    Raises:
        FileNotFoundError: there are results neither in a checkout nor in the package.
    """
    shutil.rmtree(HERE / "build", ignore_errors=True)  # or files that an earlier build left would go along
    if not SOURCE.is_dir():
        if not (TARGET / ARCHIVE_FILE).exists():
            raise FileNotFoundError(f"no results: neither {SOURCE} nor {TARGET}")
        return
    shutil.rmtree(TARGET, ignore_errors=True)
    shutil.copytree(SOURCE, TARGET, ignore=shutil.ignore_patterns(*LEFT_OUT))
    (TARGET / ARCHIVE_FILE).write_text(json.dumps(manifest(), indent=2) + "\n", encoding="utf-8")


def manifest() -> dict[str, Any]:
    """Return size and checksum of every file in the package, and how many cells and policies there are."""
    paths = sorted(path for path in TARGET.rglob("*") if path.is_file())
    ended = [json.loads(path.read_bytes())["timings"].get("ended") or "" for path in paths if path.name == "cell.json"]
    return {
        "schema": 1,
        "content": "results of codesign-bench",
        "title": "reference",
        "by": "the codesign-bench authors",
        "ended": max(ended, default=""),
        "cells": len(ended),
        "policies": sum(path.name == "policy.safetensors" for path in paths),
        "files": {
            path.relative_to(TARGET).as_posix(): {
                "bytes": path.stat().st_size,
                "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            }
            for path in paths
        },
    }
