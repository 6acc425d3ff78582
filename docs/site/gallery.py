"""Draw the gallery, docs/images/gallery: a small animation for every task and method, from shipped policies.

A task without a shipped policy is played by its script.

    python docs/site/gallery.py [--results results/reference results/all_methods] [TASK ...]

An animation shows the final policy of the first seed on the first two evaluation instances, whatever comes of them,
side by side. Where several results have a policy of a task and a method, the first of them is shown. `gallery.json`
beside the animations records what each shows. Policies of an earlier version of a task cannot play any more: their
pictures stay until results of the new version are shipped, and their record says the version.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import codesign_bench as cb
from codesign_bench.errors import UserError
from codesign_bench.evaluation.rendering import render_slot
from codesign_bench.registry import built_in
from codesign_bench.task import Behaviour, Task
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import play

ROOT = Path(__file__).resolve().parents[2]
GALLERY = ROOT / "docs" / "images" / "gallery"
RECORD = "gallery.json"
SCRIPT = "script"
"""In place of a method's name."""
EPISODES = 2
WIDTH = 260
"""Pixels of one episode; two side by side fit a narrow screen."""
FRAMES_PER_SECOND = 10.0
MOST_FRAMES = 80
COLOURS = 48
END_SECONDS = 1.5
"""Pause at the end, s."""


SHOWN = (ROOT / "results" / "reference", ROOT / "results" / "all_methods")
"""Results whose policies play."""


def cells(folders: Iterable[Path]) -> list[Path]:
    """Return, of each task and method, the default cell of the first seed with a policy in the first such folder."""
    found: dict[tuple[str, str], Path] = {}
    for folder in folders:
        for policy in sorted(folder.resolve().glob("*/*/default/seed-*/policy.safetensors")):
            task, method = policy.parts[-5:-3]
            found.setdefault((task, method), policy.parent)
    return list(found.values())


def draw(task: Task, policy: Behaviour, size: int = EPISODES) -> tuple[list[Image.Image], list[bool], float]:
    """Return one picture per moment, whether each episode ended in success, and the seconds between moments."""
    stride = max(1, round(1.0 / (FRAMES_PER_SECOND * task.control_period)), -(-task.horizon // MOST_FRAMES))
    episodes = Episodes(task, size)
    latest: dict[int, np.ndarray] = {}
    pictures = []
    for turn in play(episodes, policy, task.evaluation_instances()[:size]):
        if turn.step % stride == 0 or turn.over.any():
            latest |= {slot: render_slot(episodes, slot) for slot in turn.slots.tolist()}
            pictures.append(beside_each_other([latest[slot] for slot in sorted(latest)]))
    return pictures, [bool(success) for success in episodes.simulator.success[:size]], stride * task.control_period


def beside_each_other(frames: list[np.ndarray]) -> Image.Image:
    """Return the frames (height, width, 3) in a row with a thin line between them, each `WIDTH` wide."""
    small = [Image.fromarray(frame) for frame in frames]
    small = [one.resize((WIDTH, round(one.height * WIDTH / one.width)), Image.Resampling.LANCZOS) for one in small]
    row = Image.new("RGB", (WIDTH * len(small) + 2 * (len(small) - 1), small[0].height), "#8a9099")
    for index, one in enumerate(small):
        row.paste(one, (index * (WIDTH + 2), 0))
    return row


def gif(pictures: list[Image.Image], period: float) -> bytes:
    """Return an animation in the colours of all pictures, with a pause at the end."""
    sample = Image.new("RGB", (pictures[0].width, pictures[0].height * 3))
    for index, picture in enumerate((pictures[0], pictures[len(pictures) // 2], pictures[-1])):
        sample.paste(picture, (0, index * picture.height))
    palette = sample.quantize(COLOURS)
    first, *rest = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    durations = [round(1000.0 * period)] * len(rest) + [round(1000.0 * END_SECONDS)]
    data = io.BytesIO()
    first.save(data, "GIF", save_all=True, append_images=rest, duration=durations, loop=0, optimize=True)
    return data.getvalue()


def evaluated(cell: Path, count: int = EPISODES) -> list[bool]:
    """Return whether a cell's evaluation recorded success on its first instances."""
    with (cell / "evaluation.csv").open(encoding="utf-8") as file:
        return [row["success"] == "1" for _, row in zip(range(count), csv.DictReader(file), strict=False)]


def shown(cell: Path) -> tuple[dict[str, Any], bytes]:
    """Return the record and the animation of a cell.

    Raises:
        UserError: its policy does not fit the task as it is now.
    """
    record = json.loads((cell / "cell.json").read_text(encoding="utf-8"))
    policy, task = cb.load_policy(cell), cb.load_task(record["task"])
    pictures, solved, period = draw(task, policy)
    entry = {
        "task": record["task"],
        "method": record["method"],
        "seed": record["seed"],
        "task_version": record.get("task_version", 1),
        "cell": "/".join(cell.parts[-5:]),
        "solved": solved,
        "as_evaluated": solved == evaluated(cell),
    }
    return entry, gif(pictures, period)


def scripted(name: str) -> tuple[dict[str, Any], bytes]:
    """Return the record and the animation of a task that its script plays."""
    task = cb.load_task(name)
    pictures, solved, period = draw(task, task.script())
    entry = {"task": name, "method": SCRIPT, "task_version": task.version, "cell": None, "solved": solved}
    return entry, gif(pictures, period)


def main() -> int:
    """Draw the cells of the named tasks, or of all; return the exit code."""
    parser = argparse.ArgumentParser(description="Draw the gallery from shipped policies.")
    parser.add_argument("tasks", nargs="*", metavar="TASK", help="default: all")
    parser.add_argument("--results", type=Path, nargs="+", default=SHOWN, metavar="DIR")
    options = parser.parse_args()
    path = GALLERY / RECORD
    entries = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    known = {(entry["task"], entry["method"]): entry for entry in entries}
    GALLERY.mkdir(parents=True, exist_ok=True)
    for cell in cells(options.results):
        task, method = cell.parts[-4:-2]
        if options.tasks and task not in options.tasks:
            continue
        try:
            entry, content = shown(cell)
        except UserError as error:
            print(f"left as it is: {task} {method}: {error}")
            continue
        keep(known, entry, content)
    for task in options.tasks or built_in("tasks"):
        if not any(of_task == task for of_task, method in known if method != SCRIPT):
            keep(known, *scripted(task))
        elif known.pop((task, SCRIPT), None):
            (GALLERY / f"{task}_{SCRIPT}.gif").unlink()
    write(known)
    return 0


def keep(known: dict[tuple[str, str], dict[str, Any]], entry: dict[str, Any], content: bytes) -> None:
    """Write an animation and its record beside the others."""
    task, method = entry["task"], entry["method"]
    (GALLERY / f"{task}_{method}.gif").write_bytes(content)
    known[task, method] = entry
    evaluated_so = f", as evaluated: {entry['as_evaluated']}" if entry["cell"] else ""
    print(f"{task} {method}: {len(content) // 1000} kB, solved {entry['solved']}{evaluated_so}")
    write(known)


def write(known: dict[tuple[str, str], dict[str, Any]]) -> None:
    """Write the record of all animations."""
    records = [known[key] for key in sorted(known)]
    (GALLERY / RECORD).write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    raise SystemExit(main())
