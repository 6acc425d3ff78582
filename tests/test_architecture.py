"""Who may import whom, that tests mirror the code, and that the packages listed for installation are those on disk."""

from __future__ import annotations

import ast
import configparser
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from codesign_bench.registry import built_in, presented
from codesign_bench.study import DEFAULT_STUDY, load_study

ROOT = Path(__file__).resolve().parent.parent
FLAT_FOLDERS = ("methods", "tasks", "paper_figs")
"""Folders whose every file is one entry; what entries share lies in files and folders that begin with `_`."""

CORE = sorted((ROOT / "codesign_bench").rglob("*.py"))
OUTSIDE_STUDIES = [path for path in CORE if "studies" not in path.relative_to(ROOT).parts]
LEARNING = ROOT / "codesign_bench" / "learning"
MEMBERS = {"methods": "methods", "tasks": "tasks", "paper_figs": "paper_figs", "studies": "codesign_bench/studies"}
"""Group of members -> its folder."""

EVERY_METHOD = "tests/methods/test_contract.py and tests/methods/test_honesty.py ask every method"
PRINTED = "numbers that the paper prints"
DATA = (".j2", ".css", ".js")
"""Endings of files that are installed beside the code."""

TESTED_ELSEWHERE = {
    "codesign_bench/learning/ppo_method.py": f"an abstract class; {EVERY_METHOD}, most of which extend it",
    "codesign_bench/studies/corl2023/learners.py": f"{PRINTED}; tests/studies/corl2023/test_tables.py",
    "codesign_bench/studies/corl2023/members.py": "names alone; tests/study/test_study.py resolves every cell of them",
    "codesign_bench/studies/corl2023/protocol.py": f"{PRINTED}; tests/studies/corl2023/test_tables.py",
    "codesign_bench/studies/corl2023/ranges.py": "names of types; tests/studies/corl2023/test_tables.py reads values",
    "codesign_bench/studies/corl2023/real_robot.py": f"{PRINTED}; tests/studies/corl2023/test_scenes.py",
    "codesign_bench/task/behaviour.py": "an interface; tests/task/test_behaviours.py and tests/task/test_play.py",
    "codesign_bench/task/sketch.py": "data alone; tests/explorer/test_rollouts.py asks what every task makes of it",
    "codesign_bench/task/tool.py": "data alone; tests/tasks/test_contract.py asks what every task makes of it",
    "methods/_open_loop.py": f"{EVERY_METHOD}, two of which use it",
    "methods/_given_design.py": f"{EVERY_METHOD}, some of which extend it",
    "methods/cma_es.py": EVERY_METHOD,
    "methods/cma_rl.py": EVERY_METHOD,
    "methods/gnn_ppo.py": EVERY_METHOD,
    "methods/hwasp_minimal.py": EVERY_METHOD,
    "methods/shared_arch.py": EVERY_METHOD,
}
"""Modules without a test file of their own -> why, and which tests cover them."""

OF_NO_MODULE = {
    "tests/adapters/test_adapters.py": "of the package of adapters, where libraries are missing",
    "tests/claims/test_a_a.py": "of all rules that compare methods",
    "tests/docs/test_adapters.py": "of the learners in docs/adapters.md",
    "tests/docs/test_contributing.py": "of what CONTRIBUTING.md writes out",
    "tests/docs/test_examples.py": "of the files in docs/examples",
    "tests/docs/test_make_task_pages.py": "of the script docs/make_task_pages.py",
    "tests/docs/test_notebooks.py": "of the notebooks in docs/notebooks",
    "tests/docs/test_pages.py": "of the documentation",
    "tests/docs/test_site.py": "of the scripts in docs/site",
    "tests/learning/test_pendulum.py": "of the whole learner, beside another library's",
    "tests/learning/test_plain_update.py": "of all of an update's modules together, beside a plain one",
    "tests/methods/test_contract.py": "of every method",
    "tests/methods/test_honesty.py": "of every method: that it is what it says",
    "tests/results/test_policies.py": "of the shipped policies",
    "tests/results/test_reference.py": "of the shipped results",
    "tests/results/test_ship_cells.py": "of the script results/ship_cells.py",
    "tests/results/test_submissions.py": "of the archives of the leaderboard",
    "tests/stats/test_coverage.py": "of all intervals, beside the page on statistics",
    "tests/stats/test_rliable.py": "of all statistics, beside another library's",
    "tests/sweep/test_faults.py": "of all file operations of a sweep",
    "tests/storage/test_version_0_1_0.py": "of the whole program, on results of an earlier version",
    "tests/studies/corl2023/test_tables.py": "of several modules of data, beside the paper's tables",
    "tests/sweep/test_resume.py": "of whole sweeps that are killed",
    "tests/tasks/test_contract.py": "of every task",
    "tests/tasks/test_frozen_scenes.py": "of every task: that its scene is the one of its version",
    "tests/tasks/test_soundness.py": "of every task: that its physics are sound",
    "tests/test_command_lines.py": "of the whole program, on input that it must refuse",
    "tests/test_working_folder.py": "of the whole program, in a folder with modules of the user",
    "tests/test_architecture.py": "of the code as a whole",
    "tests/test_environments_alone.py": "of the environments, in a Python that lacks all other packages",
    "tests/test_hostile_files.py": "of every command, on results folders with damaged files",
    "tests/test_packaging.py": "of the package as it installs",
    "tests/test_reference_package.py": "of the package of reference results",
    "tests/test_portable.py": "of the settings under which `make test-portable` runs",
    "tests/test_without_pybullet.py": "of the whole program, in a Python that lacks a package",
    "tests/test_third_party.py": "of the whole program, with members of another package",
}
"""Test files that belong to no single module -> what they are tests of."""


def files(folder: str) -> list[Path]:
    """Return the Python files of a top-level folder."""
    return sorted((ROOT / folder).rglob("*.py"))


def imported(path: Path, nodes: str = "all") -> Iterator[str]:
    """Yield the full names of the modules that a file imports; with `nodes="top"`, only when it is imported itself.

    A module of `methods/` counts as `codesign_bench.methods.<file>` and so on, as it does once installed.
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    package = package_of(path)
    for node in ast.walk(tree) if nodes == "all" else tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def package_of(path: Path) -> str:
    """Return the package that a file belongs to once installed."""
    folders = path.parent.relative_to(ROOT).parts
    return ".".join(folders if folders[0] == "codesign_bench" else ("codesign_bench", *folders))


def offences(paths: list[Path], forbidden: tuple[str, ...]) -> list[str]:
    """Return "file imports module" for each import of a forbidden module or of anything below one."""
    return [
        f"{path.relative_to(ROOT)} imports {module}"
        for path in paths
        for module in imported(path)
        if any(module == name or module.startswith(f"{name}.") for name in forbidden)
    ]


def below(*names: str) -> tuple[str, ...]:
    """Return the names, seen as parts of the installed package."""
    return tuple(f"codesign_bench.{name}" for name in names)


def test_the_core_imports_no_method_task_figure_or_study() -> None:
    assert offences(CORE, (*below(*FLAT_FOLDERS), *FLAT_FOLDERS)) == []
    assert offences(OUTSIDE_STUDIES, below("studies")) == []


def test_methods_know_no_task_and_no_figure() -> None:
    assert offences(files("methods"), below("tasks", "paper_figs", "sweep", "storage", "cli")) == []


def test_tasks_know_no_method_no_study_and_nothing_of_learning() -> None:
    forbidden = below("methods", "paper_figs", "learning", "method", "sweep", "storage", "cli", "studies", "deployment")
    assert offences(files("tasks"), (*forbidden, "torch", "cma")) == []


def test_figures_are_drawn_from_results_alone() -> None:
    allowed = {"codesign_bench", "numpy", "pandas", "matplotlib", "scipy", *sys.stdlib_module_names}
    modules = {module for path in files("paper_figs") for module in imported(path)}
    assert {module.split(".")[0] for module in modules} <= allowed
    assert offences(files("paper_figs"), below("methods", "tasks", "method", "task", "learning", "sweep")) == []


def test_adapters_know_tasks_alone() -> None:
    allowed = ("codesign_bench.adapters", "codesign_bench.errors", "codesign_bench.task")
    modules = {module for path in files("codesign_bench/adapters") for module in imported(path)}
    assert [one for one in sorted(modules) if one.startswith("codesign_bench") and not one.startswith(allowed)] == []


def test_what_is_shared_by_methods_knows_neither_results_nor_running() -> None:
    shared = sorted(LEARNING.rglob("*.py"))
    assert offences(shared, below("sweep", "storage", "cli", "evaluation")) == []


@pytest.mark.parametrize("folder", FLAT_FOLDERS)
def test_a_folder_of_entries_is_flat_but_for_what_they_share(folder: str) -> None:
    folders = {path.parent.relative_to(ROOT / folder).parts for path in files(folder)} - {()}
    assert [parts for parts in folders if not parts[0].startswith("_")] == []


def test_modules_of_the_package_are_not_imported_by_their_folder_name() -> None:
    everywhere = [path for folder in ("codesign_bench", *FLAT_FOLDERS, "tests") for path in files(folder)]
    assert offences(everywhere, FLAT_FOLDERS) == []


def test_the_listed_packages_are_the_folders_on_disk() -> None:
    setup = configparser.ConfigParser()
    setup.read(ROOT / "setup.cfg")
    listed = set(setup["options"]["packages"].split())
    on_disk = {package_of(path) for path in (*CORE, *(path for folder in FLAT_FOLDERS for path in files(folder)))}
    of_data = {package_of(path) for path in (ROOT / "codesign_bench").rglob("*") if path.suffix in DATA}
    assert listed == on_disk | of_data
    mapped = dict(line.split(" = ") for line in setup["options"]["package_dir"].strip().splitlines())
    assert mapped == {f"codesign_bench.{folder}": folder for folder in FLAT_FOLDERS}


def is_of_its_own(path: Path) -> bool:
    """Return whether a module is a member that is not presented: one file is all that it needs."""
    groups = [group for group, folder in MEMBERS.items() if path.parent == ROOT / folder]
    return any(not path.stem.startswith("_") and path.stem not in presented(group) for group in groups)


def mirror_of(path: Path) -> str:
    """Return where the tests of a module belong: `a/_b.py` is tested by `tests/a/test_b.py`."""
    folder = path.parent.relative_to(ROOT)
    folder = folder.relative_to("codesign_bench") if folder.parts[0] == "codesign_bench" else folder
    return (Path("tests") / folder / f"test_{path.stem.lstrip('_')}.py").as_posix()


MIRRORED = {
    path.relative_to(ROOT).as_posix(): mirror_of(path)
    for path in (*CORE, *(path for folder in FLAT_FOLDERS for path in files(folder)))
    if not path.stem.startswith("__") and not is_of_its_own(path)
}
"""Module -> its test file."""
TEST_FILES = {path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py")}


def test_every_module_has_its_test_file_or_a_reason_why_not() -> None:
    without = {module for module, test_file in MIRRORED.items() if test_file not in TEST_FILES}
    assert without == set(TESTED_ELSEWHERE), "a reason is stale once its module is gone or has its test file"


def test_every_test_file_is_named_after_a_module_or_says_what_else_it_tests() -> None:
    others = TEST_FILES - {mirror_of(path) for path in (*CORE, *(p for f in FLAT_FOLDERS for p in files(f)))}
    assert others == set(OF_NO_MODULE), "a reason is stale once its test file is gone or has its module"


@pytest.mark.parametrize("module", TESTED_ELSEWHERE)
def test_a_reason_names_test_files_that_there_are(module: str) -> None:
    named = re.findall(r"tests/\S+\.py", TESTED_ELSEWHERE[module])
    assert named
    assert set(named) <= TEST_FILES


def reached(module: str, edges: dict[str, set[str]]) -> set[str]:
    """Return the modules that importing `module` imports in the end."""
    found, left = set(), [module]
    while left:
        for other in edges.get(left.pop(), ()):
            if other not in found:
                found.add(other)
                left.append(other)
    return found


def name_of(path: Path) -> str:
    """Return the dotted name of a file once installed."""
    return package_of(path) if path.name == "__init__.py" else f"{package_of(path)}.{path.stem}"


def imports_between(paths: list[Path], nodes: str = "all") -> dict[str, set[str]]:
    """Return module -> modules among `paths` that it imports, the packages around these included."""
    known = {name_of(path) for path in paths}
    return {name_of(path): {module for module in imported(path, nodes) if module in known} for path in paths}


def test_no_module_of_the_core_imports_itself_in_a_circle() -> None:
    edges = imports_between(CORE)
    assert sorted(module for module in edges if module in reached(module, edges)) == []


ALIKE = {("codesign_bench/storage/reference_points.py", "random_tool")}
"""Strings of the core that are spelled like a member and mean something else."""


def strings(path: Path) -> Iterator[str]:
    """Yield the string constants of a file, docstrings left out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            yield node.value


def test_the_core_names_no_method_task_or_study() -> None:
    members = {name for group in ("methods", "tasks") for name in built_in(group)}
    studies = {*built_in("studies")} - {DEFAULT_STUDY}  # may be common words, so only a whole string names one
    word = re.compile(rf"(?<![\w-])({'|'.join(sorted(members))})(?![\w-])")
    profiles = {profile.name for name in built_in("studies") for profile in load_study(name).profiles}
    named = [
        f"{place}: {text!r}"
        for path in OUTSIDE_STUDIES
        for place in (path.relative_to(ROOT).as_posix(),)
        for text in strings(path)
        if (word.search(text) or text in profiles | studies) and (place, text) not in ALIKE
    ]
    assert named == []


def room_of(module: str) -> str:
    """Return the package of the core that a module is in, or the module itself where it is in none."""
    name = module.split(".")[1] if "." in module else module
    return name if (ROOT / "codesign_bench" / name).is_dir() else module


def test_no_room_of_the_core_needs_itself_through_others() -> None:
    edges: dict[str, set[str]] = {}
    for module, others in imports_between(CORE).items():
        edges.setdefault(room_of(module), set()).update({room_of(other) for other in others} - {room_of(module)})
    assert sorted(room for room in edges if room in reached(room, edges)) == []


@pytest.mark.parametrize("heavy", ["torch", "pybullet", "pymunk", "cma", "pandas"])
def test_listing_and_helping_import_nothing_heavy(heavy: str) -> None:
    call = "import sys; from codesign_bench.cli import main; main(['list']); main(['--help']); "
    line = f"{call}print({heavy!r} in sys.modules)"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"


def test_training_a_cell_imports_nothing_that_it_does_not_need(tmp_path: Path) -> None:
    heavy = ("torch._dynamo", "sympy", "pandas", "matplotlib", "cma")  # 33 to 90 MB each, for every cell of a sweep
    out = tmp_path / "runs"
    command = f"run --method gnn_ppo --task push --profile quick --jobs 1 --seeds 1 --set steps=400 --out {out}"
    call = f"import sys; from codesign_bench.cli import main; main({command!r}.split()); "
    line = f"{call}print('found', *[name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
    assert (out / "push/gnn_ppo/default/seed-00/evaluation.csv").exists()
    assert done.stdout.splitlines()[-1] == "found"
