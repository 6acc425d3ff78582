"""The cell file, `cell.json`: identity, configuration and status of a cell. Only this module reads and writes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from codesign_bench.cell.variant import FIRST_AXES, Variant
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.settings import StoredConfig
from codesign_bench.member_code import MemberCode
from codesign_bench.storage.files import write_json
from codesign_bench.storage.json_fields import entries, number, optional, text, whole
from codesign_bench.storage.reading import JSON_BYTES, DamagedFile, NewerFile, parse_json, read_bytes

CELL_FILE = "cell.json"
SCHEMA = 2
"""Version 1 stored the first four axes of the variant as top-level entries, and no other axes."""

RESTART = "if the file is yours, delete its folder to restart the cell"
"""Said only of a cell file whose content was read and is damaged."""

FORMER_LABELS = {"GNN-PPO (paper's)": "GNN-PPO"}
"""Labels in stored cells that are the same for both credits of the design step -> the method's label since."""

FIRST_AXES_HOLD = dict(zip(FIRST_AXES, (number, number, whole, whole), strict=True))
"""Axis -> how its value is read; those of other axes may be anything."""

RUNNING, DONE, FAILED = "running", "done", "failed"
INTERRUPTED = "interrupted"
"""Not stored: the status of a cell that is recorded as running while no process holds its lock."""


@dataclass(frozen=True)
class Timings:
    """When a cell ran, and how long it took without interruptions."""

    started: str | None = None
    """UTC, ISO 8601."""
    ended: str | None = None
    """UTC, ISO 8601; None while the cell runs."""
    train_s: float | None = None
    evaluate_s: float | None = None
    wall_s: float | None = None
    peak_mb: float | None = None
    """Most memory of the cell's process and its largest child, MB; absent from cells of former versions."""
    gpu_mb: float | None = None
    """The same on the GPU; None: it used none."""


@dataclass(frozen=True)
class Failure:
    """Why a cell failed."""

    message: str = ""
    """One line."""
    traceback: str = ""

    @property
    def last_line(self) -> str:
        """The last line of the traceback, or the message if there is none."""
        lines = self.traceback.strip().splitlines()
        return lines[-1] if lines else self.message


@dataclass(frozen=True, kw_only=True)
class CellRecord:
    """The content of a cell file."""

    task: str
    method: str
    variant: Variant
    seed: int
    profile: str = DEFAULT_PROFILE
    task_version: int = 1
    """`Task.version` when it ran."""
    label: str = ""
    """The method's name in figures."""
    status: str = RUNNING
    """`RUNNING`, `DONE` or `FAILED`."""
    env_steps: int = 0
    config: StoredConfig = field(default_factory=StoredConfig)
    versions: Mapping[str, str | None] = field(default_factory=dict)
    """Package -> version, those that decide numbers, Python and the C library; None: not installed."""
    code: Mapping[str, Any] = field(default_factory=dict)
    """Version, commit, whether files differ from it, and their fingerprint; empty in cells of version 0.1.0."""
    packages: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """Package of another's task or method -> the same of its code; empty in cells of former versions."""
    members: Mapping[str, MemberCode] = field(default_factory=dict)
    """"task" and "method" -> their own code; empty in cells of former versions."""
    host: Mapping[str, Any] = field(default_factory=dict)
    """The machine; cells of version 0.1.0 name no instruction sets."""
    earlier: tuple[Mapping[str, Any], ...] = ()
    """`conditions` of the earlier parts of a cell that was resumed under others."""
    pid: int | None = None
    timings: Timings = Timings()
    failure: Failure | None = None
    checksums: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of the tables of a finished cell, by name; empty in cells of version 0.1.0."""

    @property
    def threads(self) -> int:
        """Number of cores of the cell."""
        return int(self.host.get("threads") or 1)

    @property
    def conditions(self) -> dict[str, Any]:
        """What numbers depend on in addition to the configuration, as JSON values."""
        return {
            "code": dict(self.code),
            "packages": {name: dict(code) for name, code in self.packages.items()},
            "members": {kind: code.to_json() for kind, code in self.members.items()},
            "versions": dict(self.versions),
            "host": dict(self.host),
        }

    @classmethod
    def read(cls, folder: Path) -> CellRecord | None:
        """Return the record in `folder`, or None if there is none.

        Raises:
            NewerFile: a newer version wrote it.
            DamagedFile: it is damaged or not a cell file.
            UnreadableFile: the system did not let us read it.
        """
        path = folder / CELL_FILE
        try:
            content = read_bytes(path, JSON_BYTES)
        except FileNotFoundError:
            return None
        try:
            values = parse_json(content)
            _refuse_newer(path, values)
            return cls.from_json(values)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
            reason = f"no {error}" if isinstance(error, KeyError) else str(error)
            raise DamagedFile(path, reason, RESTART) from error

    def write(self, folder: Path) -> None:
        """Replace the record in `folder`."""
        write_json(folder / CELL_FILE, self.to_json())

    def ended(self, status: str, **changes: Any) -> CellRecord:
        """Return the record of the cell after it ended with `status`; `changes` are other fields to set."""
        timings = replace(changes.pop("timings", self.timings), started=self.timings.started, ended=now())
        return replace(self, status=status, timings=timings, **changes)

    def to_json(self) -> dict[str, Any]:
        """Return the record as JSON values."""
        return {
            "schema": SCHEMA,
            "status": self.status,
            "task": self.task,
            "task_version": self.task_version,
            "method": self.method,
            "variant": self.variant.name,
            "axes": self.variant.to_json(),
            "seed": self.seed,
            "profile": self.profile,
            "label": self.label,
            "env_steps": self.env_steps,
            "config": self.config.to_json(),
            **self.conditions,
            "earlier": list(self.earlier),
            "pid": self.pid,
            "timings": asdict(self.timings),
            "failure": None if self.failure is None else asdict(self.failure),
            "checksums": dict(self.checksums),
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> CellRecord:
        """Return the record that `to_json` of this version or of version 0.1.0 (schema 1) wrote.

        Raises:
            ValueError, KeyError, TypeError, AttributeError: `content` is not a record.
        """
        schema, status = content["schema"], content["status"]
        if type(schema) is not int or schema not in (1, SCHEMA):
            raise ValueError(f"unknown schema {schema!r}")
        if status not in (RUNNING, DONE, FAILED):
            raise ValueError(f"unknown status {status!r}")
        axes = {name: content.get(name) for name in FIRST_AXES} if schema == 1 else entries(content, "axes")
        return cls(
            task=text(content, "task"),
            # absent from cells of tasks that had not changed yet
            task_version=whole(content, "task_version") if "task_version" in content else 1,
            method=text(content, "method"),
            variant=_variant(axes),
            seed=whole(content, "seed"),
            profile=text(content, "profile"),
            label=_label(content),
            status=status,
            env_steps=whole(content, "env_steps"),
            config=_config(content),
            versions=_texts_or_none(content, "versions"),
            **_code_and_host(content),
            packages={name: entries(content["packages"], name) for name in _named(content, "packages")},
            members={name: _member(content["members"], name) for name in _named(content, "members")},
            earlier=tuple(_conditions(part) for part in content.get("earlier", ())),
            pid=optional(whole, content, "pid"),
            timings=_timings(content),
            failure=_failure(content),
            checksums={name: text(content["checksums"], name) for name in _named(content, "checksums")},
        )


def now() -> str:
    """Return the current time, UTC, in the format of records."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def _refuse_newer(path: Path, values: Any) -> None:
    schema = values.get("schema") if isinstance(values, dict) else None
    if type(schema) is int and schema > SCHEMA:
        raise NewerFile(path, f"schema {schema} is from a newer version; this version reads up to {SCHEMA}")


def _label(content: Mapping[str, Any]) -> str:
    """Return the label, with the credit of the design step where a former label leaves it out."""
    label = text(content, "label" if content.get("label") else "method")
    if label not in FORMER_LABELS:
        return label
    credit = content["config"]["method"].get("design_credit", {}).get("value")
    return FORMER_LABELS[label] if credit is None else f"{FORMER_LABELS[label]}, {credit} credit"


def _variant(axes: Mapping[str, Any]) -> Variant:
    """Return the variant, whose values on the first axes must be of these axes' types."""
    variant = Variant.from_json(axes)
    for axis, read in FIRST_AXES_HOLD.items():
        optional(read, axes, axis)
    return variant


def _config(content: Mapping[str, Any]) -> StoredConfig:
    """Return the configuration, whose budget must be a number of steps."""
    config = StoredConfig.from_json(entries(content, "config"))
    whole({"steps": config.run["steps"].value}, "steps")
    return config


def _texts_or_none(content: Mapping[str, Any], name: str) -> dict[str, str | None]:
    own = entries(content, name)
    return {key: optional(text, own, key) for key in own}


def _code_and_host(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the entries on code and machine, as arguments of a record."""
    code, host = optional(entries, content, "code") or {}, entries(content, "host")
    for name in ("version", "commit", "fingerprint"):
        optional(text, code, name)
    for name in ("name", "system", "cpu"):
        optional(text, host, name)
    for name in ("threads", "cores"):
        optional(whole, host, name)
    sets = host.get("instruction_sets") or []
    if not isinstance(sets, list) or not all(isinstance(name, str) for name in sets):
        raise ValueError("'instruction_sets' is not a list of texts")
    optional(entries, host, "library_settings")
    return {"code": code, "host": host}


def _conditions(part: Any) -> dict[str, Any]:
    """Return the conditions of an earlier part of a cell."""
    if not isinstance(part, dict):
        raise ValueError("'earlier' is not a list of objects")
    return {**part, "versions": _texts_or_none(part, "versions"), **_code_and_host(part)}


def _named(content: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return an object, empty if it is absent or null."""
    return optional(entries, content, name) or {}


def _member(content: Mapping[str, Any], name: str) -> MemberCode:
    own = entries(content, name)
    files = {module: text(entries(own, "files"), module) for module in entries(own, "files")}
    return MemberCode(text(own, "module"), text(own, "package"), files)


def _timings(content: Mapping[str, Any]) -> Timings:
    own = entries(content, "timings")
    for name in own:
        optional(text if name in ("started", "ended") else number, own, name)
    return Timings(**own)


def _failure(content: Mapping[str, Any]) -> Failure | None:
    own = optional(entries, content, "failure")
    return None if own is None else Failure(text(own, "message", most=None), text(own, "traceback", most=None))
