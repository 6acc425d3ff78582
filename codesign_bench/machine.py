"""The machine and the package versions, which a result depends on in addition to its configuration."""

from __future__ import annotations

import os
import platform
import socket
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from codesign_bench import __version__

PACKAGES = ("numpy", "torch", "pymunk", "pybullet", "cma", "gymnasium")
BFLOAT16_FLAGS = ("amx_bf16", "avx512_bf16", "bf16")
"""CPU flags that indicate bfloat16 arithmetic: two of x86 (Intel, AMD) and one of ARM."""


def available_cores() -> int:
    """Return how many cores this process may use, given its affinity and its container's quota."""
    import joblib  # imported here because the process of a cell does not need it otherwise

    return int(joblib.cpu_count())


def package_versions() -> dict[str, str | None]:
    """Return the versions of Python, of this package and of `PACKAGES` without importing these; None: not installed.

    This package's is that of the code that runs: what `pip` knows of a checkout is as old as its last installation.
    """
    found: dict[str, str | None] = {"python": platform.python_version(), "codesign_bench": __version__}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


def host_facts(threads: int) -> dict[str, Any]:
    """Return the machine's name, system, processor and number of cores, and the threads per cell."""
    return {
        "name": socket.gethostname(),
        "system": platform.platform(),
        "cpu": _processor(),
        "cores": os.cpu_count(),
        "threads": threads,
    }


def computes_in_bfloat16() -> bool:
    """Return whether this processor has bfloat16 matrix products; without them, bfloat16 is slower than fp32."""
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
