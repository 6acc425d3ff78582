"""A GIF of a trial."""

from __future__ import annotations

from codesign_bench.evaluation.rendering import Moment, animation
from codesign_bench.task.episodes import Episodes

STRIDE = 3
"""Control steps between two pictures: 8 pictures per second of simulated time."""


class Film:
    """Pictures of a trial of at most `max_steps` control steps; `Deployment.play` calls it after every step."""

    def __init__(self, title: str, max_steps: int) -> None:
        self.title, self.max_steps = title, max_steps
        self._moments: list[Moment] = []

    def __call__(self, episodes: Episodes) -> None:
        """Take a picture if one is due or the trial has ended."""
        simulator, steps = episodes.simulator, int(episodes.elapsed[0])
        ended = bool(simulator.success[0] or simulator.failure[0]) or steps == self.max_steps
        if steps % STRIDE == 0 or ended:
            end = "  success" if simulator.success[0] else "  lost" if simulator.failure[0] else ""
            self._moments.append(Moment([simulator.render(0)], [f"{self.title}  step {steps}{end}"], [False]))

    def gif(self, control_period: float) -> bytes:
        """Return the pictures as a GIF in simulated time; `control_period` in s."""
        return animation(self._moments, STRIDE * control_period)
