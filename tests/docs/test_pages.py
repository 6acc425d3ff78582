"""The documentation holds: links lead somewhere, examples are tested code, every logged value is explained."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest

import codesign_bench
import contributing
from codesign_bench.config.resolve import resolve
from codesign_bench.contract import METHOD_CHECKS, TASK_CHECKS
from codesign_bench.contract.methods import LOADS as METHOD_LOADS
from codesign_bench.contract.tasks import LOADS as TASK_LOADS
from codesign_bench.method import Problem, load_method
from codesign_bench.registry import presented
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task, task_names
from codesign_bench.task.episodes import Tradeoff

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
EXAMPLE = ROOT / "tests" / "third_party"

LINK = re.compile(r"\[[^\]]*\]\(([^)#]+)[^)]*\)")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
GLOSSARY_ROW = re.compile(r"^\| `([\w<>]+)` \|", re.MULTILINE)
"""A row explains one value, or all whose names differ where it says `<...>`."""


def blocks(page: Path, language: str) -> list[str]:
    """Return the code blocks of a language on a page."""
    return [text for name, text in BLOCK.findall(page.read_text(encoding="utf-8")) if name == language]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page: Path) -> None:
    targets = [link for link in LINK.findall(page.read_text(encoding="utf-8")) if "://" not in link]
    assert [target for target in targets if not (page.parent / target).exists()] == []


@pytest.mark.parametrize("folder", ["tasks", "methods"])
def test_every_presented_member_has_a_page_that_the_index_names(folder: str) -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    names = presented(folder)
    assert names
    assert [name for name in names if not (ROOT / "docs" / folder / f"{name}.md").exists()] == []
    assert [name for name in names if f"({folder}/{name}.md)" not in index] == []


def test_examples_of_contributing_are_parts_of_the_package_that_is_tested() -> None:
    sources = [path.read_text(encoding="utf-8") for path in EXAMPLE.rglob("*") if path.suffix == ".py"]
    page = ROOT / "CONTRIBUTING.md"
    whole = contributing.files().values()  # test_contributing.py runs these
    examples = [block for block in blocks(page, "python") if block not in whole]
    assert examples
    for example in examples:
        assert any(example.strip("\n") in source for source in sources), example


def test_the_readme_uses_names_that_exist() -> None:
    (example,) = blocks(ROOT / "README.md", "python")
    used = {
        node.attr
        for node in ast.walk(ast.parse(example))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "cb"
    }
    assert used
    assert [name for name in used if not hasattr(codesign_bench, name)] == []


def unexplained(names: Iterable[str], page: str) -> list[str]:
    """Return those of `names` that no row of a glossary on the page explains."""
    patterns = [re.sub(r"<\w+>", r"\\w+", row) for row in GLOSSARY_ROW.findall(page)]
    return [name for name in names if not any(re.fullmatch(pattern, name) for pattern in patterns)]


def test_a_row_explains_what_it_names_and_nothing_else() -> None:
    page = "| name | meaning |\n| --- | --- |\n| `kl` | divergence |\n| `reward_<term>` | a part |\n"
    assert unexplained(["kl", "reward_progress", "reward_", "reward", "kl_2"], page) == ["reward_", "reward", "kl_2"]


@pytest.mark.parametrize("name", presented("methods"))
def test_every_logged_value_is_explained_on_the_methods_page(name: str) -> None:
    method_class, task_name = load_method(name), task_names()[0]
    config = resolve(method_class, task_name, "quick").method
    config = replace(config, **method_class.small())
    problem = Problem(load_task(task_name), tradeoff=Tradeoff(alpha=0.5, scale=1.0))
    report = method_class(problem, config, Streams(0)).train(320)
    page = ROOT / "docs" / "methods" / f"{name}.md"
    text = page.read_text(encoding="utf-8")
    if "two_phase_ppo.md" in text:
        text += (page.parent / "two_phase_ppo.md").read_text(encoding="utf-8")
    assert unexplained(report.metrics, text) == []


def test_the_page_on_checks_lists_every_check() -> None:
    page = (ROOT / "docs" / "checks.md").read_text(encoding="utf-8")
    for checks in ((TASK_LOADS, *TASK_CHECKS), (METHOD_LOADS, *METHOD_CHECKS)):
        rows = "\n".join(f"| {check.promise} | `{check.read}` |" for check in checks)
        assert f"| --- | --- |\n{rows}\n\n" in page
