"""Gymnasium environments of the two-phase episode, single and batched, e.g. `codesign_bench/Push-v0`.

Shapes: `B` environments, `O` observation, `D` design, `C` control, `I` instance. Registering environments imports no
task; a task is loaded when its environment is made.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from codesign_bench.task.checks import NotCopied, checked_actions, checked_instance, checked_mask
from codesign_bench.task.episodes import Tradeoff
from codesign_bench.task.loading import load_task, task_names
from codesign_bench.task.rollouts import Rollouts
from codesign_bench.task.spaces import Booleans, Floats, Singles, Slots
from codesign_bench.task.task import Task

NAMESPACE = "codesign_bench"
RGB_ARRAY = "rgb_array"
"""The render mode."""


def environment_id(task_name: str) -> str:
    """Return the Gymnasium id of a task: `scoop_3d` -> `codesign_bench/Scoop3D-v0`."""
    words = [word.upper() if word[:1].isdigit() else word[:1].upper() + word[1:] for word in task_name.split("_")]
    return f"{NAMESPACE}/{''.join(words)}-v0"


def register_environments() -> None:
    """Register an environment for every task, third-party ones included; existing registrations are kept."""
    for name in task_names():
        if environment_id(name) not in gymnasium.registry:
            gymnasium.register(
                environment_id(name),
                entry_point=f"{__name__}:ToolEnv",
                vector_entry_point=f"{__name__}:ToolVectorEnv",
                kwargs={"task_name": name},
            )


def action_space(task: Task) -> Box:
    """Return the box [design | control] of (D + C,) normalised values."""
    return Box(-1.0, 1.0, (task.design_space.size + task.control_space.size,), np.float32)


def observation_space(task: Task) -> Box:
    """Return the box [state | goal | design | phase] of (O,) values; state and goal have units."""
    design = np.ones(task.design_space.size)
    phase = np.ones(len(task.layout.PHASE_NAMES))
    low = np.concatenate([task.state_space.low, task.goal_space.low, -design, 0.0 * phase])
    high = np.concatenate([task.state_space.high, task.goal_space.high, design, phase])
    return Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def _rendering(task: Task, rollouts: Rollouts, mode: str | None) -> dict[str, Any]:
    """Return the metadata on rendering; a task that draws no pictures has no render mode."""
    modes = [RGB_ARRAY] if rollouts.episodes.simulator.draws else []
    if mode is not None and mode not in modes:
        raise ValueError(f"render_mode {mode!r}: the task '{task.name}' has {' and '.join(modes) or 'no render mode'}")
    return {"render_modes": modes, "render_fps": round(1.0 / task.control_period)}


class ToolEnv(NotCopied, gymnasium.Env[Any, Any]):
    """One two-phase episode at a time: the first step builds the tool, all later steps use it.

    Action space
        One box [design | control] in [-1, 1]. The first step reads only the design part, later ones only the control.

    Observation
        [state | goal | design | phase], as in the task's docstring; design and phase have no unit. The design is
        zero before the first step; the phase is (design phase?, control phase?, elapsed fraction of the horizon).

    Reward
        0 for the design step, then the task's reward, plus the trade-off reward (equation 1 of the paper) if requested.

    Starting state
        An instance of the task from the environment's generator, or `reset(options={"instance": (I,) array})`.

    Episode end
        Terminated by success or failure, truncated at the time limit; the last step has `info["success"]`.

    Info
        `info["reward_terms"]` on control steps: name -> value of the terms that add up to this step's reward. The names
        are those of `Task.reward_terms` (a single term, `task`, if the task names none) and `tradeoff`.

    Refused calls
        An action or instance of another shape, that is not finite, or an instance outside of the instance space, raises
        a `ValueError` before anything changes. Actions outside of [-1, 1] act like the bounds. Environments cannot be
        copied or pickled.
    """

    metadata: dict[str, Any] = {"render_modes": [RGB_ARRAY]}  # noqa: RUF012 - Gymnasium reads it from the class

    def __init__(self, task_name: str, tradeoff: Tradeoff | None = None, render_mode: str | None = None) -> None:
        self.task = load_task(task_name)
        self.observation_space = observation_space(self.task)
        self.action_space = action_space(self.task)
        self.render_mode = render_mode
        self._rollouts = Rollouts(self.task, 1, tradeoff)
        self.metadata = {**self.metadata, **_rendering(self.task, self._rollouts, render_mode)}
        self._slots: Slots = np.zeros(1, dtype=np.intp)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Begin an episode; `seed` reseeds the generator of instances.

        Raises:
            ValueError: the instance in `options` has another shape or is not in the instance space.
        """
        given = (options or {}).get("instance")
        instances = None if given is None else checked_instance(given, self.task.instance_space)
        super().reset(seed=seed)
        if instances is None:
            instances = self._rollouts.sample([self.np_random])
        self._rollouts.reset(self._slots, instances)
        return self._observation(), {}

    def step(self, action: Singles) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Take the design step or a control step with `action` (D + C,).

        Raises:
            gymnasium.error.ResetNeeded: no episode is running.
            ValueError: the action has another shape or is not finite.
        """
        if self._rollouts.ended[0]:
            raise gymnasium.error.ResetNeeded("the episode has ended or was never started: call reset() before step()")
        actions = checked_actions(action, self.task.design_space, self.task.control_space)[None]
        reward, terminated, truncated = self._rollouts.step(self._slots, actions)
        ended = bool(terminated[0] or truncated[0])
        return self._observation(), float(reward[0]), bool(terminated[0]), bool(truncated[0]), self._info(ended)

    def render(self) -> Any:
        """Return a picture of the scene, (height, width, 3), in RGB, with `render_mode="rgb_array"`; else None."""
        return self._rollouts.render(0) if self.render_mode == RGB_ARRAY else None

    def _observation(self) -> Singles:
        return self._rollouts.episodes.observation[0].copy()

    def _info(self, ended: bool) -> dict[str, Any]:
        episodes, info = self._rollouts.episodes, dict[str, Any]()
        if self._rollouts.controlled[0]:
            info["reward_terms"] = {name: float(values[0]) for name, values in episodes.reward_terms.items()}
        if ended:
            info["success"] = bool(episodes.success(self._slots)[0])
        return info


class ToolVectorEnv(NotCopied, VectorEnv[Any, Any, Any]):
    """`num_envs` environments like `ToolEnv` in one process, on the same batched simulator that methods train on.

    The step after an episode's last step begins the next episode (Gymnasium's NEXT_STEP): it ignores the action and has
    reward 0. Infos follow Gymnasium: `info["success"]` (B,) is valid where `info["_success"]` (B,) is true, on last
    steps; each term of `info["reward_terms"]` (B,) where `info["_reward_terms"]` is true, on control steps.
    Environment `i` of `reset(seed=s)` plays the same episodes as `ToolEnv` after `reset(seed=s + i)`.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium reads it from the class
        "render_modes": [RGB_ARRAY],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self, task_name: str, num_envs: int = 1, tradeoff: Tradeoff | None = None, render_mode: str | None = None
    ) -> None:
        if not isinstance(num_envs, int | np.integer) or num_envs < 1:
            raise ValueError(f"num_envs must be a positive integer, not {num_envs!r}")
        self.task = load_task(task_name)
        self.num_envs = num_envs = int(num_envs)
        self.render_mode = render_mode
        self.single_observation_space = observation_space(self.task)
        self.single_action_space = action_space(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rollouts = Rollouts(self.task, num_envs, tradeoff)
        self.metadata = {**self.metadata, **_rendering(self.task, self._rollouts, render_mode)}
        # A learner that holds environments may outlive the physics engine when Python ends: give up its worlds before.
        weakref.finalize(self, self._rollouts.close)
        self._generators: list[np.random.Generator] = [seeding.np_random()[0] for _ in range(num_envs)]

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Begin an episode in every environment, or in those of `options["reset_mask"]` (B,).

        Args:
            seed: reseeds the generators of instances: environment `i` gets `seed + i`, or `seed[i]` (None: unchanged).
            options: may hold `instance`, (I,) for all or (B, I), and `reset_mask`.

        Raises:
            ValueError: an option has another shape, an instance is not in the instance space, or the seeds are too few.
        """
        chosen = options or {}
        slots = checked_mask(chosen.get("reset_mask"), self.num_envs)
        given, generators = chosen.get("instance"), self._seeded(seed)
        space = self.task.instance_space
        instances = None if given is None else checked_instance(given, space, slots, self.num_envs)
        for slot in slots:
            self._generators[slot] = generators.get(slot, self._generators[slot])
        if instances is None:
            self._begin(slots)
        else:
            self._rollouts.reset(slots, instances)
        return self._observation(), {}

    def step(self, actions: Singles) -> tuple[Singles, Floats, Booleans, Booleans, dict[str, Any]]:
        """Step every environment with `actions` (B, D + C); those whose episode has ended begin the next one instead.

        Returns:
            observation (B, O), reward, terminated and truncated, each (B,), and info.

        Raises:
            gymnasium.error.ResetNeeded: an environment was never reset.
            ValueError: the actions have another shape, or one is not finite, even that of an ended episode.
        """
        self._rollouts.need_start("step")
        ended = self._rollouts.ended.copy()
        outcome = self._take(actions, ~ended)
        if ended.any():
            self._begin(np.flatnonzero(ended))
        return self._observation(), *outcome, self._info(~ended)

    def advance(
        self, actions: Singles, mask: Booleans | None = None
    ) -> tuple[Singles, Floats, Booleans, Booleans, dict[str, Any]]:
        """Step the environments of `mask` (B,), by default all, and begin no next episode; the others stay as they are.

        For callers that begin the next episode themselves, by `reset(options={"reset_mask": ...})`.

        Returns:
            the same as `step`; reward 0, not terminated, not truncated, and no info where nothing was stepped.

        Raises:
            gymnasium.error.ResetNeeded: an episode of `mask` has ended or was never started.
            ValueError: the actions or the mask have another shape, or an action is not finite.
        """
        chosen = np.zeros(self.num_envs, dtype=bool)
        chosen[checked_mask(mask, self.num_envs, "mask")] = True
        if self._rollouts.ended[chosen].any():
            raise gymnasium.error.ResetNeeded(
                "an episode has ended or was never started: call reset() before advance()"
            )
        outcome = self._take(actions, chosen)
        return self._observation(), *outcome, self._info(chosen)

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of every scene with `render_mode="rgb_array"`; else None."""
        if self.render_mode != RGB_ARRAY:
            return None
        return tuple(self._rollouts.render(slot) for slot in range(self.num_envs))

    def close_extras(self, **keywords: Any) -> None:
        """Give up the simulator; `close` calls this once."""
        self._rollouts.close()

    def _begin(self, slots: Slots) -> None:
        self._rollouts.reset(slots, self._rollouts.sample([self._generators[slot] for slot in slots]))

    def _seeded(self, seed: int | Sequence[int | None] | None) -> dict[int, np.random.Generator]:
        """Return the new generators of the environments that get a seed."""
        if seed is None or isinstance(seed, int | np.integer):
            seeds: Sequence[int | None] = [None if seed is None else int(seed) + slot for slot in range(self.num_envs)]
        else:
            seeds = seed
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds given for {self.num_envs} environments")
        return {slot: seeding.np_random(int(value))[0] for slot, value in enumerate(seeds) if value is not None}

    def _take(self, actions: Singles, mask: Booleans) -> tuple[Floats, Booleans, Booleans]:
        """Take the steps of the environments of `mask`; return reward, terminated and truncated, each (B,)."""
        checked = checked_actions(actions, self.task.design_space, self.task.control_space, self.num_envs)
        reward = np.zeros(self.num_envs)
        terminated, truncated = np.zeros(self.num_envs, dtype=bool), np.zeros(self.num_envs, dtype=bool)
        slots = np.flatnonzero(mask)
        if len(slots):
            reward[slots], terminated[slots], truncated[slots] = self._rollouts.step(slots, checked[slots])
        return reward, terminated, truncated

    def _observation(self) -> Singles:
        return self._rollouts.episodes.observation.copy()

    def _info(self, stepped: Booleans) -> dict[str, Any]:
        """Return the infos of `ToolEnv`, merged as `VectorEnv` merges them: masks have the prefix `_`."""
        episodes, info = self._rollouts.episodes, dict[str, Any]()
        controlled, ended = stepped & self._rollouts.controlled, stepped & self._rollouts.ended
        if controlled.any():
            terms: dict[str, Any] = {}
            for name, values in episodes.reward_terms.items():
                terms |= {name: np.where(controlled, values, 0.0), f"_{name}": controlled.copy()}
            info |= {"reward_terms": terms, "_reward_terms": controlled.copy()}
        if ended.any():
            info |= {"success": ended & episodes.simulator.success, "_success": ended.copy()}
        return info
