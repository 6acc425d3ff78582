"""The site's sources: links lead where they should, generated pages say what is registered and measured."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from PIL import Image

import code_pages
import code_text
import generated
import member_pages
import motion_pages
import study_pages
from assemble import ROOT, Site, pages, place_of
from check_links import faults
from codesign_bench.method import load_method
from codesign_bench.registry import built_in, presented
from codesign_bench.study import load_study
from codesign_bench.task import load_task

GALLERY = ROOT / "docs" / "images" / "gallery"
MOST_BYTES = 300_000


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path)


@pytest.mark.parametrize(
    ("path", "place"),
    [
        ("README.md", "index.md"),
        ("docs/index.md", "handbook.md"),
        ("docs/tasks/push.md", "tasks/push.md"),
        ("docs/tasks/notes/push.md", None),
        ("docs/site/pages/tutorial.md", "tutorial.md"),
        ("docs/notebooks/first_experiment.ipynb", "notebooks/first_experiment.ipynb"),
        ("results/TUNING.md", "results/tuning.md"),
        ("results/reference/README.md", "results/reference.md"),
        ("results/reference/figures/final_results.md", None),
        ("methods/gnn_ppo.py", None),
    ],
)
def test_a_page_of_the_repository_has_a_place_on_the_site(path: str, place: str | None) -> None:
    assert (ROOT / path).exists()
    assert place_of(path) == place


def test_no_two_pages_have_the_same_place() -> None:
    places = [place_of(name) for name in pages()]
    assert len(places) == len(set(places))


@pytest.mark.parametrize(
    ("link", "turned"),
    [
        ("[a](../index.md#the-episode)", "[a](../handbook.md#the-episode)"),
        ("[`a`](../../results/TUNING.md)", "[`a`](../results/tuning.md)"),
        ("[a](https://example.org/x.md)", "[a](https://example.org/x.md)"),
        ("[a](#here)", "[a](#here)"),
        ("[a](/studies/credit.md)", "[a](../studies/credit.md)"),
        ("```\n[a](nowhere.md)\n```", "```\n[a](nowhere.md)\n```"),
    ],
)
def test_links_lead_to_places_on_the_site(site: Site, link: str, turned: str) -> None:
    assert site.with_links(link, "docs/tasks/push.md", "tasks/push.md") == turned


def test_what_is_no_page_is_shown_by_one_and_pictures_are_copied(site: Site) -> None:
    text = "[a](../../tasks/push.py) ![b](../images/precision.png) [c](../../paper_figs)"
    turned = site.with_links(text, "docs/tasks/push.md", "tasks/push.md")
    assert turned == (
        "[a](../source/tasks/push.py.md) ![b](../files/docs/images/precision.png) [c](../source/paper_figs.md)"
    )
    assert "class Push(" in (site.out / "source/tasks/push.py.md").read_text(encoding="utf-8")
    assert (site.out / "files/docs/images/precision.png").exists()
    assert "- `timing_table.py`" in (site.out / "source/paper_figs.md").read_text(encoding="utf-8")


def test_a_link_to_nothing_is_reported(site: Site) -> None:
    with pytest.raises(FileNotFoundError, match=r"docs/tasks/push\.md links to gone\.md"):
        site.with_links("[a](gone.md)", "docs/tasks/push.md", "tasks/push.md")


def test_a_notebook_gets_the_address_of_the_published_project(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("assemble.REPOSITORY", "https://github.com/someone/fork")
    name = "docs/notebooks/first_experiment.ipynb"
    text = site.notebook((ROOT / name).read_text(encoding="utf-8"), name, "notebooks/first_experiment.ipynb")
    assert "colab.research.google.com/github/someone/fork/blob/main/docs/notebooks/" in text
    assert "git+https://github.com/someone/fork" in text


def test_the_table_of_methods_has_every_method_and_what_is_measured() -> None:
    page = member_pages.methods()
    rows = {row.split("[")[1].split("]")[0]: row for row in page.splitlines() if row.startswith("| [")}
    for name in built_in("methods"):
        assert f"docs/methods/{name}.md" in page
        assert ("one per goal" if load_method(name).tool_per_goal else "one for all goals") in page
    assert set(built_in("methods")) <= set(rows)
    for row in member_pages.final_results():
        if row["task"] == "average":
            assert f"{float(row['normalized_score']):.2f} [" in page


@pytest.mark.parametrize("name", built_in("methods"))
def test_every_method_says_what_learns_and_from_where(name: str) -> None:
    summary, source = member_pages.told_by_module(name)
    assert len(summary) > 20
    assert source


@pytest.mark.parametrize("name", presented("tasks"))
def test_the_list_of_tasks_says_what_each_asks_for(name: str) -> None:
    task = load_task(name)
    (row,) = [line for line in member_pages.tasks().splitlines() if line.startswith(f"| [{name}]")]
    numbers = (task.design_space.size, task.control_space.size, task.goal_size, task.horizon)
    assert row.endswith("| " + " | ".join(str(number) for number in numbers) + " |")


@pytest.mark.reference
def test_a_page_of_a_study_has_its_verdicts_and_figures() -> None:
    study = load_study("corl2023")
    folders = study_pages.shipped(study)
    assert folders
    page = study_pages.study_page(study)
    for folder in folders:
        claims = json.loads((folder / "claims" / "claims.json").read_text(encoding="utf-8"))["claims"]
        assert [claim["name"] for claim in claims if claim["sentence"] not in page] == []
        assert f"results/{folder.name}/figures/final_results.png" in page
        supported = sum(claim["verdict"] == "supported" for claim in claims)
        assert f"{folder.name}: {len(claims)} claims: {supported} supported" in study_pages.studies()


def test_a_study_without_results_says_so() -> None:
    assert study_pages.shipped(load_study("necessity")) or "no claim is judged" in study_pages.study_page(
        load_study("necessity")
    )


def test_the_api_reference_has_every_package_and_public_name() -> None:
    found = dict(code_pages.api())
    everything = "\n".join(found.values())
    files = [path for path in (ROOT / "codesign_bench").rglob("*.py") if not path.stem.startswith("_")]
    modules = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in files]
    assert [name for name in modules if f".. automodule:: {name}\n" not in everything] == []
    assert ".. autofunction:: codesign_bench.load_results" in found["api/index.md"]


def test_public_names_are_those_that_a_module_defines_and_explains(tmp_path: Path) -> None:
    path = tmp_path / "module.py"
    path.write_text(
        'from math import pi\nA: int = 1\n"""Told."""\nB = 2\nC = 3\n"""Told."""\n_D = 4\n"""Told."""\n'
        "def f(): ...\ndef _g(): ...\nclass K: ...\n",
        encoding="utf-8",
    )
    assert code_text.public(path) == ["A", "C", "f", "K"]


def test_code_of_a_file_is_shown_by_name() -> None:
    path = ROOT / "docs" / "examples" / "practice.py"
    assert code_text.definition(path, "Practice").startswith("class Practice(Axis):")
    assert code_text.definition(path, "STUDY").startswith("STUDY = Study(")
    with pytest.raises(ValueError, match="defines no Nothing"):
        code_text.definition(path, "Nothing")


@pytest.mark.reference
def test_every_shipped_policy_is_in_the_gallery_and_did_there_what_its_evaluation_says() -> None:
    policies = "*/*/default/seed-*/policy.safetensors"
    folders = [ROOT / "results" / name for name in ("reference", "all_methods")]
    shipped = {path.parts[-5:-3] for folder in folders for path in folder.glob(policies)}
    entries = [entry for entry in motion_pages.entries() if entry["cell"]]
    assert {(entry["task"], entry["method"]) for entry in entries} == shipped
    assert [entry for entry in entries if not entry["as_evaluated"]] == []
    assert [entry["cell"] for entry in entries if not (ROOT / "results" / entry["cell"]).is_dir()] == []


def test_every_task_is_in_motion_if_only_by_its_script() -> None:
    assert motion_pages.tasks_in_motion().count(":::{figure}") == len(built_in("tasks"))
    assert {entry["task"] for entry in motion_pages.entries()} == set(built_in("tasks"))
    assert all(
        entry["task_version"] == load_task(entry["task"]).version
        for entry in motion_pages.entries()
        if not entry["cell"]
    )


def test_pictures_of_the_gallery_move_and_are_small() -> None:
    sizes = {}
    for entry in motion_pages.entries():
        path = GALLERY / f"{entry['task']}_{entry['method']}.gif"
        with Image.open(path) as picture:
            assert getattr(picture, "n_frames", 1) > 1, path
        sizes[path.name] = path.stat().st_size
    assert [name for name, size in sizes.items() if size > MOST_BYTES] == []
    assert {path.name for path in GALLERY.glob("*.gif")} == set(sizes)


@pytest.mark.parametrize("workflow", sorted((ROOT / ".github" / "workflows").glob("*.yml")), ids=lambda path: path.stem)
def test_actions_are_pinned_by_commit(workflow: Path) -> None:
    used = re.findall(r"uses: (\S+)", workflow.read_text(encoding="utf-8"))
    assert used
    assert [action for action in used if not re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", action)] == []


def test_the_page_of_the_explorer_has_it_in_a_frame() -> None:
    page = generated.completed("docs/explorer.md", (ROOT / "docs" / "explorer.md").read_text(encoding="utf-8"))
    assert page.count(f'src="{generated.EXPLORER}"') == 1
    assert generated.EXPLORED.is_dir()


def test_a_page_of_a_task_moves() -> None:
    name = "docs/tasks/push.md"
    text = generated.completed(name, (ROOT / name).read_text(encoding="utf-8"))
    assert text.index("push_gnn_ppo.gif") < text.index("## Action")


def test_faults_of_a_built_site_are_reported(tmp_path: Path) -> None:
    (tmp_path / "b.html").write_text('<h2 id="there">B</h2>', encoding="utf-8")
    (tmp_path / "a.html").write_text(
        '<a href="b.html#there">1</a><a href="b.html#gone">2</a><a href="c.html">3</a><img src="x.png">'
        '<a href="https://example.org">4</a><script src="https://example.org/x.js"></script>',
        encoding="utf-8",
    )
    assert faults(tmp_path) == [
        "a.html: picture without a text: x.png",
        "a.html: loads https://example.org/x.js from elsewhere",
        "a.html: b.html#gone leads to no place on its page",
        "a.html: c.html leads to nothing",
        "a.html: x.png leads to nothing",
    ]
