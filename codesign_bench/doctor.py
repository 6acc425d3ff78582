"""What a bug report needs: versions, processor, threads, and what is missing for which task: `codesign-bench doctor`.

Nothing of it identifies a person or a machine: no name of a host, a user or a folder.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from importlib.metadata import PackageNotFoundError, entry_points, requires, version
from typing import TYPE_CHECKING, TypeAlias

from codesign_bench.code_version import code_version
from codesign_bench.errors import UserError, in_one_line
from codesign_bench.machine import (
    C_LIBRARY,
    PACKAGES,
    available_cores,
    computes_in_bfloat16,
    host_facts,
    package_versions,
    total_megabytes,
)
from codesign_bench.method import load_method
from codesign_bench.processes import THREAD_VARIABLES
from codesign_bench.registry import KINDS, load_module, names
from codesign_bench.startup import PROGRAM
from codesign_bench.task import load_task

if TYPE_CHECKING:
    from packaging.requirements import Requirement

Section: TypeAlias = Mapping[str, str]
"""Fact -> its value, in the order of printing."""
NOT_INSTALLED = "not installed"
HOSTED = ("system", "cpu", "architecture")
"""Facts about the host that identify nobody."""
LOADERS: Mapping[str, Callable[[str], object]] = {
    "tasks": load_task,
    "methods": load_method,
    "paper_figs": partial(load_module, "paper_figs"),
    "studies": partial(load_module, "studies"),
}
"""Group of members -> how one of them is loaded."""
PLURALS = {"paper_figs": "figures"}
"""Group -> its name in messages, where that is another."""


def diagnosis() -> dict[str, Section]:
    """Return all of it: heading -> what stands under it."""
    return {
        PROGRAM: {"version": str(code_version())},
        "system": _system(),
        "threads": _threads(),
        "packages": packages(),
        "extras": extras(),
        "members": members(),
    }


def _system() -> Section:
    host = host_facts(threads=1)
    memory = total_megabytes()
    return {
        "python": f"{platform.python_version()} ({platform.python_implementation()})",
        **{name: str(host[name]) for name in HOSTED},
        "C library": package_versions()[C_LIBRARY] or "unknown",
        "instruction sets": ", ".join(host["instruction_sets"]) or "unknown",
        "bfloat16 products": "yes" if computes_in_bfloat16() else "no",
        "memory": "unknown" if memory is None else f"{memory / 1024.0:.1f} GB",
        "GPU": _gpu(),
    }


def _gpu() -> str:
    try:
        import torch
    except Exception as error:  # a damaged installation is what a report is about
        return f"unknown: torch cannot be imported: {in_one_line(error)}"
    if torch.cuda.is_available():
        return f"{torch.cuda.get_device_name(0)}, CUDA {torch.version.cuda}"
    return (
        f"none that torch can use (its build is for {'CUDA ' + torch.version.cuda if torch.version.cuda else 'CPUs'})"
    )


def _threads() -> Section:
    """Return the cores, the thread pools of this process, and what is set in the environment."""
    settings = {name: os.environ[name] for name in THREAD_VARIABLES if name in os.environ}
    try:
        cores = str(available_cores())
    except ImportError as error:  # where the environments alone are installed
        cores = f"unknown number ({error.name} is not installed)"
    found = {
        "cores": f"{cores} of {os.cpu_count()} may be used",
        **_pools(),
        **settings,
        **host_facts(threads=1)["library_settings"],
    }
    return found if settings else {**found, "environment": f"none of {', '.join(THREAD_VARIABLES)} is set"}


def _pools() -> Section:
    try:
        from threadpoolctl import threadpool_info
    except ImportError:  # it comes with scikit-learn
        return {}
    import numpy  # noqa: F401  # its thread pools are reported, too

    pools = {
        f"{pool['internal_api']} ({pool['prefix']})": ", ".join(
            [_count(pool["num_threads"]), *([f"version {pool['version']}"] if pool.get("version") else [])]
        )
        for pool in threadpool_info()
    }
    torch = sys.modules.get("torch")
    return pools if torch is None else {**pools, "torch": _count(torch.get_num_threads())}


def _count(threads: int) -> str:
    return f"{threads} thread{'s' * (threads != 1)}"


def _requirements() -> list[Requirement]:
    """Return what the installed package requires, with its extras.

    Nothing is known of them where the package is on the path without being installed, or where `packaging` is missing,
    as with the environments alone.
    """
    try:
        from packaging.requirements import Requirement

        return [Requirement(text) for text in requires(PROGRAM) or ()]
    except (PackageNotFoundError, ImportError):
        return []


def _applies(requirement: Requirement, extra: str = "") -> bool:
    return requirement.marker is None or requirement.marker.evaluate({"extra": extra})


def packages() -> Section:
    """Return the version of each package that this Python needs, and of those that decide numbers.

    A version that is not the one that is needed is followed by that.
    """
    needed = {each.name: each.specifier for each in _requirements() if _applies(each)}
    found = {}
    for name in sorted({*PACKAGES, *needed}):
        there, allowed = _version(name), needed.get(name)
        found[name] = there or NOT_INSTALLED
        if allowed is not None and (there is None or not allowed.contains(there, prereleases=True)):
            found[name] += f" (needed: {allowed})"
    return found


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def extras() -> Section:
    """Return every extra with "installed", or with the packages that it lacks."""
    found: dict[str, list[str]] = {}
    for requirement in _requirements():
        for extra in _extras_of(requirement):
            lacking = found.setdefault(extra, [])
            if _version(requirement.name) is None:
                lacking.append(requirement.name)
    return {extra: f"lacks {', '.join(lacking)}" if lacking else "installed" for extra, lacking in found.items()}


def _extras_of(requirement: Requirement) -> Iterable[str]:
    """Return the extras that bring a requirement; none if it is a dependency, or for another Python or system."""
    if _applies(requirement):
        return []
    marker = str(requirement.marker)
    return [
        extra
        for extra in dict.fromkeys(marker.replace("'", '"').split('extra == "')[1:])
        for extra in (extra.split('"')[0],)
        if _applies(requirement, extra)
    ]


def members() -> Section:
    """Return, for every group of members, how many can be used, and each that cannot with the reason.

    Members of other packages are named with their package.
    """
    found: dict[str, str] = {}
    for group, load in LOADERS.items():
        reasons = {name: reason for name in names(group) if (reason := _why_not(load, name))}
        found[PLURALS.get(group, group)] = f"{len(names(group)) - len(reasons)} of {len(names(group))} can be used"
        found |= {f"  {name}": reason for name, reason in reasons.items()}
        for point in sorted(entry_points(group=f"codesign_bench.{group}"), key=lambda point: point.name):
            package = "another package" if point.dist is None else f"{point.dist.name} {point.dist.version}"
            found[f"  {KINDS[group]} {point.name}"] = f"from {package}"
    return found


def _why_not(load: Callable[[str], object], name: str) -> str:
    """Return why a member cannot be used, or nothing if it can."""
    try:
        load(name)
    except UserError as error:
        return str(error)
    except Exception as error:  # a fault in a package is what a report is about
        return in_one_line(error)
    return ""
