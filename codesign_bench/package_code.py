"""Which code a package is: its version, its commit where it lies in a git checkout, and a fingerprint of its files.

`code_version` says the same of codesign-bench itself; here are the packages of other tasks and methods.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path

from codesign_bench.code_version import CodeVersion, checked_out, code_version
from codesign_bench.source_code import CORE, SourceModule

RESULTS_MARKER = "codesign-bench.json"
"""A folder with this file holds results, not code."""
CACHES = ("__pycache__",)
MOST_BYTES = 64 * 2**20
"""Of a larger file, only its size counts."""


@lru_cache
def package_code(package: str) -> CodeVersion:
    """Return the code of a package, given the name that `package_of` returned."""
    if package == CORE:
        return code_version()
    root = SourceModule(package)
    folders = [Path(place) for place in (root.spec and root.spec.submodule_search_locations) or ()]
    files = {f"{path.relative_to(folder).as_posix()}": path for folder in folders for path in _files(folder)}
    if not folders and root.file is not None:
        files = {root.file.name: root.file}
    commit, changed = (None, None) if root.file is None else checked_out(root.file, folders or [root.file])
    return CodeVersion(_version(package), commit, changed, _fingerprint(files))


def _version(package: str) -> str | None:
    distributions = set(packages_distributions().get(package.partition(".")[0], ()))
    if len(distributions) != 1:
        return None
    try:
        return version(distributions.pop())
    except PackageNotFoundError:
        return None


def _files(folder: Path) -> Iterator[Path]:
    """Yield the files of a package; not bytecode, hidden files, and results that lie in it."""
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.name in CACHES or path.suffix == ".pyc":
            continue
        if path.is_dir() and not path.is_symlink() and not (path / RESULTS_MARKER).exists():
            yield from _files(path)
        elif path.is_file():
            yield path


def _fingerprint(files: Mapping[str, Path]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        size = files[name].stat().st_size
        digest.update(f"{name} {size}\n".encode())
        if size <= MOST_BYTES:
            digest.update(files[name].read_bytes())
    return digest.hexdigest()
