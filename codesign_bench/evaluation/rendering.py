"""Pictures of behaviour: a few episodes side by side as an animation, or moments of them as one picture.

Shapes: `E` episodes, `T` moments, `O` observation, `D` design, `C` control; a frame is (height, width, 3) in RGB.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from codesign_bench.errors import UserError
from codesign_bench.storage.files import write_output
from codesign_bench.task import Behaviour, Frame, Task
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import play

SUFFIXES = (".gif", ".png")
FRAMES_PER_SECOND = 15.0
"""Largest number of frames per second of simulated time; GIFs cannot show many more."""
END_SECONDS = 1.0
"""Pause at the end of an animation, s."""
MOMENTS = 8
"""Number of moments of an episode in one picture, including start and end."""
SHEET_SAMPLES = 40
"""A picture's moments are chosen from about this many, evenly spaced over the horizon."""
CAPTION_PIXELS = 16
CAPTION_COLOUR, PAPER = "#202020", "#ffffff"


@dataclass(frozen=True)
class Moment:
    """Pictures of E episodes at one moment; of an episode that is over, its end."""

    frames: list[Frame]
    captions: list[str]
    over: list[bool]
    """Whether an episode was over before this moment."""


def render(task: Task, behaviour: Behaviour, path: Path, episodes: int = 4) -> str:
    """Write `behaviour` on the task's first evaluation instances to `path`, a GIF or a PNG; return a line about it.

    Raises:
        UserError: an unknown suffix, a task without pictures, or a path that is not writable.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"--out {path}: the file must end in {' or '.join(SUFFIXES)}")
    animated = path.suffix.lower() == ".gif"
    stride = _stride(task) if animated else max(1, task.horizon // SHEET_SAMPLES)
    moments = list(_moments(task, behaviour, episodes, stride))
    solved = sum("success" in caption for caption in moments[-1].captions)
    content = animation(moments, stride * task.control_period) if animated else _sheet(moments)
    write_output(f"--out {path}", path, content)
    return f"{path}: {solved} of {len(moments[-1].captions)} episodes solved"


def _moments(task: Task, behaviour: Behaviour, count: int, stride: int) -> Iterator[Moment]:
    """Play the first `count` evaluation instances in parallel; yield every `stride`-th step and every end."""
    instances = task.evaluation_instances()[:count]
    episodes = Episodes(task, len(instances))
    total, over = np.zeros(len(instances)), np.zeros(len(instances), dtype=bool)
    frames: dict[int, Frame] = {}
    for turn in play(episodes, behaviour, instances):
        total[turn.slots] += turn.reward
        if turn.step % stride == 0 or turn.over.any():
            frames |= {slot: render_slot(episodes, slot) for slot in turn.slots.tolist()}
            yield Moment([frames[slot] for slot in sorted(frames)], _captions(episodes, total), over.tolist())
        over[turn.slots] = turn.over


def render_slot(episodes: Episodes, slot: int) -> Frame:
    """Return a picture of the scene in a slot.

    Raises:
        UserError: the task draws no pictures.
    """
    try:
        return episodes.simulator.render(slot)
    except NotImplementedError:  # what a simulator without pictures raises
        raise UserError(f"task '{episodes.task.name}' draws no pictures") from None


def _captions(episodes: Episodes, total: np.ndarray) -> list[str]:
    ends = [
        "  success" if success else "  lost" if failure else ""
        for success, failure in zip(episodes.simulator.success, episodes.simulator.failure, strict=True)
    ]
    return [
        f"step {step}  return {value:.2f}{end}" for step, value, end in zip(episodes.elapsed, total, ends, strict=True)
    ]


def _stride(task: Task) -> int:
    """Return the number of control steps per frame of an animation."""
    return max(1, round(1.0 / (FRAMES_PER_SECOND * task.control_period)))


def animation(moments: list[Moment], period: float) -> bytes:
    """Return a GIF with one moment every `period` s and a pause at the end."""
    pictures = [Image.fromarray(np.concatenate(_captioned(moment), axis=1)) for moment in moments]
    durations = [round(1000.0 * period)] * (len(pictures) - 1) + [round(1000.0 * END_SECONDS)]
    data = io.BytesIO()
    first, *rest = [picture.convert("P", palette=Image.Palette.ADAPTIVE) for picture in pictures]
    first.save(data, "GIF", save_all=True, append_images=rest, duration=durations, loop=0, disposal=1)
    return data.getvalue()


def _sheet(moments: list[Moment]) -> bytes:
    """Return a PNG with one row per episode: its moments from start to end."""
    pictures = [_captioned(moment) for moment in moments]
    rows = []
    for episode in range(len(moments[0].frames)):
        seen = [index for index, moment in enumerate(moments) if not moment.over[episode]]
        chosen = np.linspace(0, len(seen) - 1, MOMENTS).round().astype(int)
        rows.append(np.concatenate([pictures[seen[index]][episode] for index in chosen], axis=1))
    data = io.BytesIO()
    Image.fromarray(np.concatenate(rows, axis=0)).save(data, "PNG")
    return data.getvalue()


def _captioned(moment: Moment) -> list[Frame]:
    """Return every frame of a moment with its caption below."""
    result = []
    for frame, text in zip(moment.frames, moment.captions, strict=True):
        strip = Image.new("RGB", (frame.shape[1], CAPTION_PIXELS), PAPER)
        ImageDraw.Draw(strip).text((4, 2), text, fill=CAPTION_COLOUR)
        result.append(np.concatenate([frame, np.asarray(strip)]))
    return result
