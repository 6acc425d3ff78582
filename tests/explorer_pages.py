"""What tests of the explorer share: a small page, its data, and designs computed by its own script in Node.js."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from builders import VERSION_0_1_0
from codesign_bench.explorer.gather import Choice
from codesign_bench.explorer.page import write_explorer
from codesign_bench.task import Floats

NODE = shutil.which("node")
"""The program, if it is installed."""
TEMPLATES = Path(__file__).resolve().parents[1] / "codesign_bench" / "explorer" / "templates"
SMALL = Choice(tasks=("push",), goals=8)

SCRIPT = """
const { core } = (() => { %s; return { core }; })();
const { tasks, asked } = JSON.parse(require("fs").readFileSync(0, "utf8"));
(async () => {
  const answers = [];
  for (const { task, cell, points } of asked) {
    const of_task = await core.loadTask(tasks[task]);
    const of_cell = await core.loadCell(of_task, tasks[task].cells[cell]);
    answers.push({
      designs: points.map((point) => Array.from(of_cell.design(point))),
      tools: points.map((point) => of_task.tool && Array.from(core.toolValues(of_task.tool, of_cell.design(point)))),
      nearest: points.map((point) => core.nearestPoint(of_task, point)),
      frames: of_cell.episodes && of_cell.episodes.map((frames) => frames.map((frame) => Array.from(frame.pose))),
      recorded: Array.from(of_cell.recordedDesigns),
    });
  }
  console.log(JSON.stringify(answers));
})();
"""


def write_page(out: Path, results: Path = VERSION_0_1_0, choice: Choice = SMALL) -> list[str]:
    """Write a page to `out` and return the lines that were logged."""
    lines: list[str] = []
    write_explorer(results, out, lines.append, choice)
    return lines


def data_of(page: str) -> dict[str, Any]:
    """Return the data in a page."""
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    data: dict[str, Any] = json.loads(found)
    return data


def in_node(tasks: list[dict[str, Any]], asked: list[tuple[int, int, Floats]]) -> list[dict[str, Any]]:
    """Return what the page's own script computes for points of cells: (task, cell, points) each."""
    assert NODE is not None
    questions = [{"task": task, "cell": cell, "points": np.asarray(points).tolist()} for task, cell, points in asked]
    done = subprocess.run(
        [NODE, "-e", SCRIPT % (TEMPLATES / "core.js").read_text(encoding="utf-8").replace('"use strict";', "", 1)],
        input=json.dumps({"tasks": tasks, "asked": questions}),
        capture_output=True,
        text=True,
        check=True,
    )
    answers: list[dict[str, Any]] = json.loads(done.stdout)
    return answers
