"""Pictures of tasks: a moment of each task's script at work."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.evaluation.rendering import render_slot
from codesign_bench.figures.source import Request, tasks_shown
from codesign_bench.task import Task, load_task
from codesign_bench.task.episodes import Episodes
from codesign_bench.task.play import play

if TYPE_CHECKING:
    import pandas as pd

TRIED = 6
"""Number of a task's first evaluation instances that are played; the one with the highest return is drawn."""
MOMENT = 0.6
"""Moment of the picture as a fraction of the episode: the tool has reached the object and is not finished."""


def tasks_at_work(request: Request) -> pd.DataFrame:
    """Return one picture of each task in the results; also of every task of the study if the figure was named.

    Returns:
        Columns task, title, instance (its number), step (of the picture), steps (of the whole episode), return and
        success (at its end), picture (height, width, 3).

    Raises:
        UserError: no task can be drawn.
    """
    import pandas as pd

    rows = []
    for name in tasks_shown(request):
        try:
            rows.append(_at_work(load_task(name)))
        except UserError as error:
            request.log(f"picture of {name} left out: {error}")
    if not rows:
        raise UserError("none of the tasks has both a script and pictures")
    return pd.DataFrame(rows)


def _at_work(task: Task) -> dict[str, Any]:
    """Return the row of a task."""
    script = task.script()
    instances = task.evaluation_instances()[:TRIED]
    evaluation = evaluate(task, script, instances=instances)
    best = int(evaluation.returns.argmax())
    steps = int(evaluation.lengths[best])
    step = max(1, round(MOMENT * steps))
    episodes = Episodes(task, 1)
    next(turn for turn in play(episodes, script, instances[best : best + 1]) if turn.step == step)
    picture = render_slot(episodes, 0)
    return {
        "task": task.name,
        "title": task.title,
        "instance": best,
        "step": step,
        "steps": steps,
        "return": float(evaluation.returns[best]),
        "success": int(evaluation.successes[best]),
        "picture": picture,
    }
