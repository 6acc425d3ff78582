"""Which code runs: its version, its commit where it lies in a git checkout, and a fingerprint of its files."""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import codesign_bench

PACKAGES = ("codesign_bench", "codesign_bench.methods", "codesign_bench.tasks")
"""What decides numbers; figures only draw them. `member_code` covers members of other packages."""
SHORT = 12
"""Digits of a commit or a fingerprint that messages show."""
GIT_SECONDS = 10.0


@dataclass(frozen=True)
class CodeVersion:
    """The code of a package; fingerprints of ours cover its Python files, those of others all of their files."""

    version: str | None
    """None: it is not installed."""
    commit: str | None
    """None: the code does not lie in a git checkout of itself, or git cannot be asked."""
    changed: bool | None
    """Whether a file of the code differs from the commit; None without a commit."""
    fingerprint: str
    """SHA-256 over names and contents of files; an installed copy has the same as its checkout."""

    def to_json(self) -> dict[str, Any]:
        """Return the entries as JSON values."""
        return asdict(self)

    def __str__(self) -> str:
        if self.commit is None:
            return f"codesign-bench {self.version}, files {self.fingerprint[:SHORT]}"
        changes = ", with changes that are not committed" if self.changed else ""
        return f"codesign-bench {self.version}, commit {self.commit[:SHORT]}{changes}"


def code_version(folders: Sequence[Path] | None = None) -> CodeVersion:
    """Return the version of the code in `folders`, the package's own folder first; by default of the code that runs."""
    folders = _own_folders() if folders is None else list(folders)
    commit, changed = checked_out(folders[0] / "__init__.py", folders, ".py")
    return CodeVersion(codesign_bench.__version__, commit, changed, fingerprint(folders))


def fingerprint(folders: Sequence[Path]) -> str:
    """Return a hash of the names and contents of all Python files below `folders`.

    Folders inside the first one count by their own name, so that it makes no difference whether `methods/` lies beside
    the package, as in a checkout, or in it, as installed.
    """
    files: dict[str, Path] = {}
    for folder in folders:
        for path in folder.rglob("*.py"):
            if not any(other in path.parents for other in folders if folder in other.parents):
                files[f"{folder.name}/{path.relative_to(folder).as_posix()}"] = path
    digest = hashlib.sha256()
    for name in sorted(files):
        content = files[name].read_bytes()
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _own_folders() -> list[Path]:
    specs = [find_spec(name) for name in PACKAGES]
    return [Path(place) for spec in specs if spec is not None for place in spec.submodule_search_locations or ()]


def checked_out(tracked: Path, paths: Sequence[Path], suffix: str = "") -> tuple[str | None, bool | None]:
    """Return the commit that is checked out, and whether a file below `paths` whose name ends in `suffix` differs.

    Both are None if `tracked`, a file of the code, is in no git checkout, or git cannot be asked.
    """
    try:
        _git(tracked.parent, "ls-files", "--error-unmatch", tracked.name)  # else the checkout is another project's
        commit = _git(tracked.parent, "rev-parse", "HEAD")
        listed = ("status", "--porcelain", "--untracked-files=all", "--", *map(str, paths))
        changes = _git(tracked.parent, *listed)
    except (OSError, subprocess.SubprocessError):
        return None, None
    return commit, any(line.rstrip('"').endswith(suffix) for line in changes.splitlines())


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=GIT_SECONDS, check=True).stdout.strip()
