"""Our batched environments behind the interfaces of other libraries; each library is an extra.

`SB3VecEnv` is for stable-baselines3 (extra `sb3`), `TorchRLEnv` for TorchRL (extra `torchrl`). Importing this package
imports neither of them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from codesign_bench.errors import UnavailableError

if TYPE_CHECKING:
    from codesign_bench.adapters.sb3 import SB3VecEnv
    from codesign_bench.adapters.torchrl import TorchRLEnv

__all__ = ["SB3VecEnv", "TorchRLEnv"]

_HOMES = {"SB3VecEnv": "sb3", "TorchRLEnv": "torchrl"}
"""Class -> its module, which is also the name of the extra."""


def __getattr__(name: str) -> Any:
    """Return a class, importing its library.

    Raises:
        AttributeError: there is no such class.
        UnavailableError: its library is not installed.
    """
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    extra = _HOMES[name]
    try:
        return getattr(import_module(f"{__name__}.{extra}"), name)
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        install = f"pip install 'codesign-bench[{extra}]'"
        raise UnavailableError(f"{name} needs {library}, which is not installed: {install}") from error


def __dir__() -> list[str]:
    return sorted(__all__)
