"""codesign-bench: which way of learning a tool's design together with its control works best, and how sure are we?

Importing the package imports no method, no simulator and no torch; its names are resolved on first use.
"""

from __future__ import annotations

from codesign_bench.startup import prepare as _prepare

_prepare()  # before any other import: it settles where modules come from

# isort: split
from importlib import import_module  # noqa: E402  # after prepare(), for the reason above
from typing import TYPE_CHECKING, Any  # noqa: E402  # likewise

if TYPE_CHECKING:
    from codesign_bench.errors import UserError
    from codesign_bench.method import load_method, method_names
    from codesign_bench.storage.frames import load_results
    from codesign_bench.storage.policies import load_policy
    from codesign_bench.task import load_task, task_names

__version__ = "0.2.0"

_HOMES = {
    "UserError": "errors",
    "load_method": "method",
    "load_policy": "storage.policies",
    "load_results": "storage.frames",
    "load_task": "task",
    "method_names": "method",
    "task_names": "task",
}

__all__ = [
    "UserError",
    "__version__",
    "load_method",
    "load_policy",
    "load_results",
    "load_task",
    "method_names",
    "task_names",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


import_module(f"{__name__}.task.envs").register_environments()
