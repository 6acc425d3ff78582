"""What a result depends on besides its configuration: the machine and the versions of the packages."""

from __future__ import annotations

import os
import platform
import socket
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("codesign_bench", "numpy", "torch", "pymunk", "pybullet", "cma", "gymnasium")
BFLOAT16_FLAGS = ("amx_bf16", "avx512_bf16", "bf16")
"""What processors that compute in bfloat16 say of themselves: Intel's and AMD's, and ARM's."""


def available_cores() -> int:
    """Return how many cores this process may use: its affinity and its container's quota count."""
    import joblib  # not at the top: the process of a cell has no other use for it

    return int(joblib.cpu_count())


def package_versions() -> dict[str, str | None]:
    """Return Python's version and those of the packages, without importing any; None is not installed."""
    found: dict[str, str | None] = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


def host_facts(threads: int) -> dict[str, Any]:
    """Return the machine's name, system, processor and cores, and the threads of one cell."""
    return {
        "name": socket.gethostname(),
        "system": platform.platform(),
        "cpu": _processor(),
        "cores": os.cpu_count(),
        "threads": threads,
    }


def computes_in_bfloat16() -> bool:
    """Tell whether this processor multiplies matrices in bfloat16 itself; elsewhere that is slower than in fp32."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return False
    flags = {
        flag for line in lines if line.startswith(("flags", "Features")) for flag in line.partition(":")[2].split()
    }
    return not flags.isdisjoint(BFLOAT16_FLAGS)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
