"""The code of a member: what is told as changed, and what is not."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import pytest

from builders import write_files
from codesign_bench.member_code import MemberCode, member_code, package_of


@pytest.fixture
def sticks(modules: Path) -> Path:
    """Return the folder of a package with one member."""
    reach = "from . import mass\nclass Reach: ...\n"
    write_files(modules / "sticks", {"__init__.py": "", "reach.py": reach, "mass.py": "M = 1\n"})
    return modules / "sticks"


def member() -> MemberCode:
    """Return the code of the member as it is on disk."""
    importlib.invalidate_caches()
    member_code.cache_clear()
    return member_code(importlib.import_module("sticks.reach").Reach)


def test_a_change_of_own_code_is_told_by_module(sticks: Path) -> None:
    before = member()
    assert (before.module, before.package) == ("sticks.reach", "sticks")
    assert member().changed_since(before) == []
    (sticks / "mass.py").write_text("M = 2\n")
    assert member().changed_since(before) == ["sticks.mass"]
    (sticks / "reach.py").write_text("class Reach: ...\n")
    assert member().changed_since(before) == ["sticks.reach", "sticks.mass"]


def test_a_change_of_other_files_and_of_comments_is_none(sticks: Path) -> None:
    before = member()
    write_files(sticks, {"README.md": "A", "other.py": "A = 1\n", "mass.py": "M = 1  # kg\n", "__init__.py": "A = 1\n"})
    assert member().changed_since(before) == []


def test_code_that_moved_is_the_same_code(sticks: Path) -> None:
    before = member()
    files = {f"elsewhere.{name}": digest for name, digest in before.files.items()}
    assert before.changed_since(MemberCode("elsewhere.reach", "elsewhere", files)) == []


def test_a_base_class_from_the_same_package_counts_however_it_was_found(sticks: Path) -> None:
    load = "import importlib\nBase = importlib.import_module('sticks.base').Base\n"
    write_files(sticks, {"base.py": "class Base: ...\n", "reach.py": f"{load}class Reach(Base): ...\n"})
    assert set(member().files) == {"sticks.reach", "sticks.base"}


def test_a_member_belongs_to_the_outermost_package_that_is_one_folder(modules: Path) -> None:
    write_files(modules, {"alone.py": "", "space/inner/deep.py": "", "whole/__init__.py": "", "whole/a.py": ""})
    found = [package_of(name) for name in ("alone", "space.inner.deep", "whole.a", "codesign_bench.tasks.push")]
    assert found == ["alone", "space.inner.deep", "whole", "codesign_bench"]


def test_the_code_of_a_member_is_told_as_json_values(sticks: Path) -> None:
    found = member()
    assert MemberCode(**json.loads(json.dumps(found.to_json()))) == found
