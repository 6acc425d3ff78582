"""The manifest of an archive of results: what it says of itself, and what every file must be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from codesign_bench.storage.json_fields import entries, optional, text, whole

SCHEMA = 1
CONTENT = "results of codesign-bench"
LONGEST_NOTE = 2_000
"""Characters of a text that the author wrote."""


@dataclass(frozen=True)
class StoredFile:
    """What a file of an archive must be."""

    size: int
    """Bytes."""
    sha256: str


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """What an archive says of itself."""

    title: str = ""
    by: str = ""
    """Who submits it."""
    note: str = ""
    ended: str = ""
    """When the last of its cells ended, UTC, ISO 8601."""
    cells: int = 0
    policies: int = 0
    """Number of cells with a policy."""
    packed_by: Mapping[str, Any] = field(default_factory=dict)
    """The code that wrote the archive: version, commit, whether files differ from it, fingerprint."""
    code: tuple[Mapping[str, Any], ...] = ()
    """The codes that ran the cells, likewise, each with its number of `cells`."""
    versions: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    """Package -> its versions, each with its number of cells."""
    tuning_note: str = ""
    """How the settings were found, in the author's words."""
    tuning_steps: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    """Task -> method -> environment steps that were spent on finding its settings, as far as they are known."""
    files: Mapping[str, StoredFile] = field(default_factory=dict)
    """Path of every other file -> what it must be."""

    def to_json(self) -> dict[str, Any]:
        """Return the manifest as JSON values."""
        return {
            "schema": SCHEMA,
            "content": CONTENT,
            "title": self.title,
            "by": self.by,
            "note": self.note,
            "ended": self.ended,
            "cells": self.cells,
            "policies": self.policies,
            "packed_by": dict(self.packed_by),
            "code": [dict(code) for code in self.code],
            "versions": {name: dict(counts) for name, counts in self.versions.items()},
            "tuning": {"note": self.tuning_note, "env_steps": {t: dict(m) for t, m in self.tuning_steps.items()}},
            "files": {name: {"bytes": file.size, "sha256": file.sha256} for name, file in self.files.items()},
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Manifest:
        """Return the manifest that `to_json` wrote.

        Raises:
            ValueError, KeyError, TypeError, AttributeError: `content` is not a manifest.
        """
        if content["schema"] != SCHEMA or content["content"] != CONTENT:
            raise ValueError("it is not the manifest of an archive")
        tuning = optional(entries, content, "tuning") or {}
        code = content.get("code") or []
        if not isinstance(code, list) or not all(isinstance(part, dict) for part in code):
            raise ValueError("'code' is not a list of objects")
        return cls(
            title=_optional_text(content, "title"),
            by=_optional_text(content, "by"),
            note=_optional_text(content, "note"),
            ended=_optional_text(content, "ended"),
            cells=optional(whole, content, "cells") or 0,
            policies=optional(whole, content, "policies") or 0,
            packed_by=optional(entries, content, "packed_by") or {},
            code=tuple(code),
            versions=_counts(optional(entries, content, "versions") or {}),
            tuning_note=_optional_text(tuning, "note"),
            tuning_steps=_counts(optional(entries, tuning, "env_steps") or {}),
            files=_files(entries(content, "files")),
        )


def _optional_text(content: Mapping[str, Any], name: str) -> str:
    """Return a text that the author may have written, or an empty one."""
    return text(content, name, most=LONGEST_NOTE) if content.get(name) is not None else ""


def _counts(content: Mapping[str, Any]) -> dict[str, dict[str, int]]:
    """Return names -> names -> numbers."""
    return {name: {key: whole(entries(content, name), key) for key in entries(content, name)} for name in content}


def _files(content: Mapping[str, Any]) -> dict[str, StoredFile]:
    return {
        name: StoredFile(whole(entries(content, name), "bytes"), text(entries(content, name), "sha256"))
        for name in content
    }
