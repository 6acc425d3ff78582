"""The notebooks run from the first cell to the last, are stored without output, and open on Colab."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from conf import GITHUB, UNPUBLISHED

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
MOST_LINES = 40
"""So many lines of code, or fewer, make a task or a method."""


def cells(notebook: Path, kind: str = "code") -> list[dict[str, Any]]:
    """Return the cells of a kind."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    return [cell for cell in content["cells"] if cell["cell_type"] == kind]


def as_script(notebook: Path) -> str:
    """Return a notebook's code as a program: files are written, commands are run, and a failure ends it."""
    parts = ["import subprocess, pathlib"]
    for cell in cells(notebook):
        text = "".join(cell["source"])
        if "install" in cell["metadata"].get("tags", ()):
            continue
        if text.startswith("%%writefile "):
            first, rest = text.split("\n", 1)
            parts.append(f"pathlib.Path({first.split()[1]!r}).write_text({rest!r})")
        elif text.startswith("!"):
            parts.append(f"subprocess.run({text[1:]!r}, shell=True, check=True)")
        else:
            parts.append(text)
    return "\n".join(parts)


def test_there_are_two() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["first_experiment", "own_task_and_method"]


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_runs_from_the_first_cell_to_the_last(notebook: Path, tmp_path: Path) -> None:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": path, "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, "-c", as_script(notebook)], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert list(tmp_path.glob("*/*/*/default/seed-00/policy.safetensors"))


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_stored_without_output_and_opens_on_colab(notebook: Path) -> None:
    assert [cell["id"] for cell in cells(notebook) if cell["outputs"] or cell["execution_count"]] == []
    texts = "".join("".join(cell["source"]) for cell in cells(notebook, "markdown"))
    address = f"https://colab.research.google.com/github/{UNPUBLISHED}/blob/main/docs/notebooks/{notebook.name}"
    assert f"({address})" in texts
    (install,) = [cell for cell in cells(notebook) if "install" in cell["metadata"].get("tags", ())]
    assert f"git+{GITHUB}{UNPUBLISHED}\n" in "".join(install["source"]) + "\n"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_plot_has_a_text(notebook: Path) -> None:
    plots = [cell for cell in cells(notebook) if "plt.show()" in "".join(cell["source"])]
    assert plots
    assert all(cell["metadata"].get("mystnb", {}).get("image", {}).get("alt") for cell in plots)


def test_a_task_and_a_method_take_at_most_forty_lines_each() -> None:
    texts = ["".join(cell["source"]) for cell in cells(ROOT / "docs" / "notebooks" / "own_task_and_method.ipynb")]
    files = [text.split("\n")[1:] for text in texts if text.startswith("%%writefile")]
    assert len(files) == 2
    assert all(sum(bool(line.strip()) for line in lines) <= MOST_LINES for lines in files)
