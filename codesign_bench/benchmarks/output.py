"""Write measured speeds to a file, with all that they depend on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from codesign_bench.code_version import code_version
from codesign_bench.console import Log
from codesign_bench.machine import host_facts, package_versions
from codesign_bench.storage.files import json_bytes, write_output


def write_speeds(out: Path | None, content: Mapping[str, Any], cores: int, log: Log) -> None:
    """Write `content`, JSON values by name, with versions, code and machine to `out`, if given, and log its name.

    Args:
        out: the file.
        content: what was measured.
        cores: of a cell.
        log: logs a line.

    Raises:
        UserError: the file is not writable.
    """
    if out is None:
        return
    conditions = {"versions": package_versions(), "code": code_version().to_json(), "host": host_facts(cores)}
    write_output(f"--out {out}", out, json_bytes({**content, **conditions}))
    log(str(out))
