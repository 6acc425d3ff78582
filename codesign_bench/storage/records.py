"""The cell file, `cell.json`: identity, configuration and status of a cell. Only this module reads and writes it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from codesign_bench.cell.variant import FIRST_AXES, Variant
from codesign_bench.config.profiles import DEFAULT_PROFILE
from codesign_bench.config.settings import StoredConfig
from codesign_bench.errors import UserError
from codesign_bench.member_code import MemberCode
from codesign_bench.storage.files import write_json

CELL_FILE = "cell.json"
SCHEMA = 2
"""Version 1 stored the first four axes of the variant as top-level entries, and no other axes."""

FORMER_LABELS = {"GNN-PPO (paper's)": "GNN-PPO"}
"""Labels in stored cells that are the same for both credits of the design step -> the method's label since."""

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

    @property
    def threads(self) -> int:
        """Number of cores of the cell."""
        return int(self.host.get("threads", 1))

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
            UserError: it is damaged or not a cell file.
        """
        path = folder / CELL_FILE
        try:
            return cls.from_json(json.loads(path.read_text()))
        except FileNotFoundError:
            return None
        except (ValueError, KeyError, TypeError, AttributeError, OSError) as error:
            reason = f"no {error}" if isinstance(error, KeyError) else str(error)
            raise UserError(f"cannot read {path} ({reason}); delete its folder to restart the cell") from error

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
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> CellRecord:
        """Return the record that `to_json` of this version or of version 0.1.0 (schema 1) wrote.

        Raises:
            ValueError, KeyError, TypeError, AttributeError: `content` is not a record.
        """
        schema, status = content["schema"], content["status"]
        if schema not in (1, SCHEMA):
            raise ValueError(f"schema {schema} is from a newer version; this version reads up to {SCHEMA}")
        if status not in (RUNNING, DONE, FAILED):
            raise ValueError(f"unknown status {status!r}")
        axes = {name: content.get(name) for name in FIRST_AXES} if schema == 1 else content["axes"]
        failure = content["failure"]
        return cls(
            task=_text(content, "task"),
            task_version=int(content.get("task_version", 1)),  # absent from cells of tasks that had not changed yet
            method=_text(content, "method"),
            variant=Variant.from_json(axes),
            seed=int(content["seed"]),
            profile=_text(content, "profile"),
            label=_label(content),
            status=status,
            env_steps=int(content["env_steps"]),
            config=StoredConfig.from_json(content["config"]),
            versions=dict(content["versions"].items()),
            code=dict(content.get("code", {}).items()),
            packages={name: dict(code.items()) for name, code in content.get("packages", {}).items()},
            members={kind: MemberCode.from_json(code) for kind, code in content.get("members", {}).items()},
            host=dict(content["host"].items()),
            earlier=tuple(dict(part.items()) for part in content.get("earlier", ())),
            pid=content.get("pid"),
            timings=Timings(**content["timings"]),
            failure=None if failure is None else Failure(str(failure["message"]), str(failure["traceback"])),
        )


def now() -> str:
    """Return the current time, UTC, in the format of records."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def _label(content: Mapping[str, Any]) -> str:
    """Return the label, with the credit of the design step where a former label leaves it out."""
    label = str(content.get("label") or content["method"])
    if label not in FORMER_LABELS:
        return label
    credit = content["config"]["method"].get("design_credit", {}).get("value")
    return FORMER_LABELS[label] if credit is None else f"{FORMER_LABELS[label]}, {credit} credit"


def _text(content: Mapping[str, Any], name: str) -> str:
    value = content[name]
    if not isinstance(value, str):
        raise TypeError(f"'{name}' is not text")
    return value
