"""The machine and the package versions, which a result depends on in addition to its configuration."""

from __future__ import annotations

import os
import platform
import re
import socket
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from codesign_bench import __version__

PACKAGES = ("numpy", "torch", "scipy", "pymunk", "pybullet", "cma", "gymnasium")
"""Those that decide numbers."""
FORKS = {"pybullet": "pybullet-arm64"}
"""Package -> another one that brings the same module, where there is no wheel of the first."""
C_LIBRARY = "c_library"
"""Beside the packages: the library whose sine and exponential the physics engines call."""
INSTRUCTION_SETS = (
    *("avx", "fma", "avx2", "avx512f", "avx512_bf16", "avx512_fp16", "amx_tile", "amx_bf16"),
    *("asimd", "sve", "sve2", "bf16"),
)
"""CPU flags by which numerical libraries choose how to compute: those of x86 and those of ARM."""
LIBRARY_SETTINGS = (
    "ATEN_CPU_CAPABILITY",
    "MKL_ENABLE_INSTRUCTIONS",
    "MKL_CBWR",
    "ONEDNN_MAX_CPU_ISA",
    "OPENBLAS_CORETYPE",
    "NPY_DISABLE_CPU_FEATURES",
    "GLIBC_TUNABLES",
)
"""Environment variables that make these libraries choose otherwise."""
CUDA_CONTEXT = 500.0
"""What is allowed for the CUDA context of a process on a GPU, beside its tensors, MB (ours; not measured)."""
BFLOAT16_FLAGS = ("amx_bf16", "avx512_bf16", "bf16")
"""CPU flags that indicate bfloat16 arithmetic: two of x86 (Intel, AMD) and one of ARM."""


def available_cores() -> int:
    """Return how many cores this process may use, given its affinity and its container's quota."""
    import joblib  # imported here because the process of a cell does not need it otherwise

    return int(joblib.cpu_count())


def package_versions() -> dict[str, str | None]:
    """Return the versions of Python, of this package, of `PACKAGES` and of the C library; None: not installed.

    No package is imported. This package's version is that of the code that runs: what `pip` knows of a checkout is as
    old as its last installation.
    """
    found: dict[str, str | None] = {"python": platform.python_version(), "codesign_bench": __version__}
    for name in PACKAGES:
        found[name] = _version(name)
        if found[name] is None and name in FORKS and (other := _version(FORKS[name])):
            found[name] = f"{other} ({FORKS[name]})"
    found[C_LIBRARY] = " ".join(platform.libc_ver()).strip() or None
    return found


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def host_facts(threads: int) -> dict[str, Any]:
    """Return the machine's name, system, processor and number of cores, and the threads per cell.

    Of the processor: its model, its architecture, its `INSTRUCTION_SETS`, and `LIBRARY_SETTINGS` that are set.
    """
    flags = _flags()
    return {
        "name": socket.gethostname(),
        "system": platform.platform(),
        "cpu": _processor(),
        "architecture": platform.machine(),
        "instruction_sets": [name for name in INSTRUCTION_SETS if name in flags],
        "library_settings": {name: os.environ[name] for name in LIBRARY_SETTINGS if os.environ.get(name)},
        "cores": os.cpu_count(),
        "threads": threads,
    }


def computes_in_bfloat16() -> bool:
    """Return whether this processor has bfloat16 matrix products; without them, bfloat16 is slower than fp32."""
    return not _flags().isdisjoint(BFLOAT16_FLAGS)


def total_megabytes() -> float | None:
    """Return the memory of this machine in MB, or None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**20
    except (AttributeError, OSError, ValueError):
        return None


def gpu_megabytes() -> float | None:
    """Return the most GPU memory that this process has used, in MB; None: it has used no GPU."""
    torch = sys.modules.get("torch")
    if torch is None or not torch.cuda.is_initialized():
        return None
    return round(CUDA_CONTEXT + torch.cuda.max_memory_reserved() / 2**20, 1)


def total_gpu_megabytes() -> float | None:
    """Return the memory of the GPU that cells use, in MB; None: there is none. This imports torch."""
    import torch

    return torch.cuda.get_device_properties(0).total_memory / 2**20 if torch.cuda.is_available() else None


def peak_megabytes() -> float:
    """Return the peak memory of this process plus those of its children that are still there, such as its workers.

    Ended children do not count. `getrusage` has the largest of them, but a child that was started for another program
    has its parent's memory for a moment, so it would count the parent twice.
    """
    import resource  # there is none on Windows

    own = _peak_kilobytes("self")
    if own is None:  # no /proc; this maximum survives `exec`, so it may be that of the parent process
        return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, 1)
    children = (pid for path in Path("/proc/self/task").glob("*/children") for pid in path.read_text().split())
    return round((own + sum(_peak_kilobytes(pid) or 0 for pid in children)) / 1024.0, 1)


def _peak_kilobytes(pid: str) -> int | None:
    """Return the peak memory of a process, or None if it has ended, or the system has no /proc."""
    try:
        found = re.search(r"^VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    except OSError:
        return None
    return None if found is None else int(found[1])


def _flags() -> set[str]:
    """Return the CPU flags; empty where the system does not tell them in Linux's way."""
    return {
        flag
        for line in _cpu_lines()
        if line.startswith(("flags", "Features"))
        for flag in line.partition(":")[2].split()
    }


def _processor() -> str:
    names = [line.partition(":")[2].strip() for line in _cpu_lines() if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _cpu_lines() -> list[str]:
    try:
        return Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return []
