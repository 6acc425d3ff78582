"""Which code runs: a commit where it lies in a checkout of itself, and a fingerprint everywhere."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

import codesign_bench
from codesign_bench.code_version import CodeVersion, code_version, fingerprint

GIT = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


def git(folder: Path, *arguments: str) -> str:
    """Run git in `folder` as somebody; return what it printed."""
    somebody = ("-c", "user.name=a", "-c", "user.email=a@example.com", "-c", "core.hooksPath=/dev/null")
    command = ["git", *somebody, *arguments]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path) -> list[Path]:
    """Return the folders of a package and of its methods, side by side in a new checkout with nothing committed."""
    folders = [tmp_path / "package", tmp_path / "methods"]
    for folder in folders:
        folder.mkdir()
        (folder / "__init__.py").write_text("")
    (folders[1] / "one.py").write_text("STEP = 1\n")
    return folders


@GIT
def test_the_commit_is_told_where_the_code_is_a_checkout_and_nowhere_else(checkout: list[Path]) -> None:
    root = checkout[0].parent
    git(root, "init")
    other = code_version(checkout)  # another project's checkout, with the package in its environment
    assert (other.commit, other.changed) == (None, None)
    assert str(other) == f"codesign-bench {codesign_bench.__version__}, files {other.fingerprint[:12]}"
    git(root, "add", ".")
    git(root, "commit", "--message", "one")
    clean = code_version(checkout)
    assert (clean.commit, clean.changed) == (git(root, "rev-parse", "HEAD"), False)
    assert str(clean) == f"codesign-bench {codesign_bench.__version__}, commit {str(clean.commit)[:12]}"


@GIT
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("methods/one.py", True),
        ("package/__init__.py", True),
        ("methods/new.py", True),
        ("methods/notes.txt", False),
        ("README.md", False),
    ],
)
def test_the_code_has_changed_once_a_python_file_of_it_has(checkout: list[Path], name: str, changes: bool) -> None:
    root = checkout[0].parent
    git(root, "init")
    git(root, "add", ".")
    git(root, "commit", "--message", "one")
    (root / name).write_text("STEP = 2\n")
    found = code_version(checkout)
    assert found.changed == changes
    assert str(found).endswith("not committed") == changes


def test_an_installed_copy_has_the_fingerprint_of_its_checkout(checkout: list[Path], tmp_path: Path) -> None:
    package = Path(shutil.copytree(checkout[0], tmp_path / "site" / "package"))
    methods = Path(shutil.copytree(checkout[1], package / "methods"))
    assert fingerprint([package, methods]) == fingerprint(checkout)


def test_a_fingerprint_changes_with_a_files_content_and_with_its_name(checkout: list[Path]) -> None:
    found = [fingerprint(checkout)]
    (checkout[1] / "one.py").write_text("STEP = 2\n")
    found.append(fingerprint(checkout))
    (checkout[1] / "one.py").rename(checkout[1] / "two.py")
    found.append(fingerprint(checkout))
    (checkout[1] / "notes.txt").write_text("not code")
    assert fingerprint(checkout) == found[-1]
    assert len(set(found)) == 3


def test_the_code_that_runs_is_told_as_json_values() -> None:
    found = code_version()
    assert found.version == codesign_bench.__version__
    assert len(found.fingerprint) == 64
    assert CodeVersion(**found.to_json()) == found
