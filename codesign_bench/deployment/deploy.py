"""`codesign-bench deploy`: run trials of a policy on a simulated arm, and write tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from codesign_bench import __version__
from codesign_bench.deployment.conditions import Conditions
from codesign_bench.deployment.pictures import Film
from codesign_bench.deployment.protocol import Trial, grid_trials, own_trials
from codesign_bench.deployment.rollout import Deployment
from codesign_bench.deployment.tables import (
    FOLDER,
    PICTURES_FOLDER,
    SEED,
    SOLVED_IN_TRAINING,
    SUMMARY_SUFFIX,
    TRIALS_FILE,
    protocol_file,
    row,
    summarise,
)
from codesign_bench.errors import UserError
from codesign_bench.seeding import generator
from codesign_bench.storage.files import Outputs, json_bytes
from codesign_bench.storage.layout import open_folder, rows_bytes
from codesign_bench.task import Behaviour, Floats, Task, deployment_of
from codesign_bench.task.robot import IDEAL


@dataclass(frozen=True)
class Order:
    """The trials to run."""

    conditions: Conditions
    tools: tuple[int, ...] = ()
    """Numbers of tools, starting at 1; empty: all."""
    trials: int = 1
    """Trials of each tool on its own instance."""
    protocol: bool = False
    """Whether to run the paper's protocol: its number of trials, and every tool on the grid."""
    seed: int = 0
    gifs: bool = True
    """Whether to draw every trial."""
    policy_seed: int = 0
    """The seed that the policy was trained with."""


def deploy(
    task: Task, policy: Behaviour, order: Order, out: Path, say: Callable[[str], None], source: str = ""
) -> list[dict[str, Any]]:
    """Run the trials of `order`, write them below `out` and return one row each.

    Args:
        task: the policy's task.
        policy: designs and controls the tools.
        order: the trials to run.
        out: a results folder; files are written to `out`/deployment/<task>.
        say: prints a line.
        source: name of the policy's cell, for the summary.

    Raises:
        UserError: the task cannot be deployed, a number of `order` is invalid, or a file cannot be written;
            then none is.
    """
    if order.trials < 1:
        raise UserError(f"--trials must be at least 1, not {order.trials}")
    settings = deployment_of(task).trials
    tools = order.tools or tuple(range(1, len(settings.own) + 1))
    planned = list(own_trials(settings, tools, settings.trials_per_tool if order.protocol else order.trials))
    planned += grid_trials(settings, tools) if order.protocol else []
    deployment = Deployment(task, policy, order.conditions)
    open_folder(out)
    folder = out / FOLDER / task.name
    path = folder / (protocol_file(order.policy_seed) if order.protocol else TRIALS_FILE)
    unit_designs = {tool: deployment.unit_design(settings.own[tool - 1]) for tool in tools}
    in_training = _solved_in_training(task, policy, order, unit_designs)
    designs: dict[str, dict[str, float]] = {}
    rows = []
    with Outputs(f"--out {out}") as outputs:
        for trial in planned:
            film = Film(f"{task.title}, tool {trial.tool}", settings.max_steps) if order.gifs else None
            rng = generator(order.seed, f"deploy {task.name} {trial.name}")
            rollout = deployment.play(trial.instance, unit_designs[trial.tool], rng, film)
            values = deployment.episodes.designs[0].tolist()
            designs[str(trial.tool)] = dict(zip(task.design_space.names, values, strict=True))
            where = {name: getattr(trial, name) for name in ("kind", "tool", "trial", "row", "column")}
            where |= {SEED: order.policy_seed, SOLVED_IN_TRAINING: in_training[trial.tool]}
            rows.append(row(task, settings, trial.instance, rollout, **where))
            if film is not None:
                outputs.write(folder / PICTURES_FOLDER / f"{trial.name}.gif", film.gif(task.control_period))
            say(_line(trial, rows[-1]))
        summary = {
            "version": __version__,
            "task": task.name,
            "policy": source,
            "seed": order.seed,
            "conditions": asdict(order.conditions),
            "max_steps": settings.max_steps,
            "designs": designs,
            "tools": summarise(rows),
        }
        outputs.write(path, rows_bytes(rows))
        outputs.write(path.with_suffix(SUMMARY_SUFFIX), json_bytes(summary))
    say(str(path))
    return rows


def _solved_in_training(
    task: Task, policy: Behaviour, order: Order, unit_designs: Mapping[int, Floats]
) -> dict[int, int]:
    """Return for each tool whether the policy solves its own instance with the gantry of training, without noise.

    A trial has fewer steps than an episode of training; here it has as many as on the arm.
    """
    gantry = Deployment(task, policy, Conditions(arm=IDEAL))
    own = deployment_of(task).trials.own
    rng = generator(order.seed, f"deploy {task.name} in training physics")  # draws nothing: nothing is perturbed
    return {tool: int(gantry.play(own[tool - 1], design, rng).success) for tool, design in unit_designs.items()}


def _line(trial: Trial, values: dict[str, Any]) -> str:
    """Return the printed line of a trial."""
    end = "success" if values["success"] else "nearly" if values["near"] else "lost" if values["lost"] else "failure"
    incidents = [f"{name} {values[name]}" for name in values if name.endswith("_steps") and values[name]]
    error = f"tracking error {values['tracking_error_mean_mm']:.1f} mm, at most {values['tracking_error_max_mm']:.1f}"
    return f"{trial.name}: {end} after {values['steps']} steps; {error}; {', '.join(incidents) or 'no incidents'}"
