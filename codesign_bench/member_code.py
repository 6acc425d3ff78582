"""Which modules a task or a method is made of, each with a fingerprint."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

from codesign_bench.source_code import SourceModule, essence, is_own, own_modules


@dataclass(frozen=True)
class MemberCode:
    """The code of one task or method."""

    module: str
    """The module that defines it."""
    package: str
    """The package that contains the module, or the module itself if it is a single file."""
    files: Mapping[str, str]
    """Module -> SHA-256 of its source without comments and docstrings, for all modules of its own code."""

    def to_json(self) -> dict[str, Any]:
        """Return the entries as JSON values."""
        return {**asdict(self), "files": dict(self.files)}

    def changed_since(self, stored: MemberCode) -> list[str]:
        """Return the names of own modules that differ from those of `stored`; modules may have moved."""
        if sorted(self.files.values()) == sorted(stored.files.values()):
            return []
        names = dict.fromkeys((*self.files, *stored.files))
        return [name for name in names if self.files.get(name) != stored.files.get(name)]


@lru_cache
def member_code(member: type) -> MemberCode:
    """Return the code of a task or method, given its class."""
    bases = [base.__module__ for base in member.__mro__[1:]]  # one may have been found by its name, not by an import
    modules = dict.fromkeys([member.__module__, *(name for name in bases if is_own(name, member.__module__))])
    found = {module.name: module for name in modules for module in own_modules(name)}
    files = {name: hashlib.sha256(essence(module.content or b"")).hexdigest() for name, module in found.items()}
    return MemberCode(member.__module__, package_of(member.__module__), files)


def package_of(module: str) -> str:
    """Return the outermost package of a module that is one folder of code; the module itself if it is in none.

    A namespace package is spread over the folders of several projects, so that it is none.
    """
    parts = module.split(".")
    names = [".".join(parts[: end + 1]) for end in range(len(parts))]
    return next((name for name in names if SourceModule(name).file is not None), module)
