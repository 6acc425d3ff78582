"""Co-adaptation: one tool for all goals, searched on the critic of an off-policy learner.

Source: Luck, Ben Amor and Calandra, "Data-efficient Co-Adaptation of Morphology and Behaviour with Deep Reinforcement
Learning" (CoRL 2019), and its code. A tool is used for some episodes. Individual networks are trained for it, and
population networks for all tools so far. The next tool is, in turn, one that the population's critic likes best or a
random one.

Shapes: `K` stored starts, `P` designs, `n` transitions, `O` observation, `D` design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.config.search import Integer, LogUniform
from codesign_bench.config.settings import Settings
from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Share, Within
from codesign_bench.learning.batches import BatchCollector, most_steps, slots_for
from codesign_bench.learning.checkpointing import learner_arrays, load_learner_arrays, load_module_arrays
from codesign_bench.learning.explorer import FixedDesigns, Trial
from codesign_bench.learning.network_policy import NetworkPolicy
from codesign_bench.learning.particle_swarm import Fitness, SwarmConfig, maximize
from codesign_bench.learning.ppo_config import BatchSteps
from codesign_bench.learning.replay import ReplayBuffer, Transitions
from codesign_bench.learning.soft_actor_critic import (
    SoftActorCritic,
    SoftActorCriticConfig,
    SquashedActor,
    SquashedExplorer,
)
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.method import BatchReport, Method, Policy, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats, Task

from ._settings import Tuned, tuned

POPULATION_AFTER = 3
"""Tools that are tried before the population networks are trained (source, code)."""
UpdatesPerStep = Annotated[float, Within(0.0, 100.0)]
Episodes = Annotated[int, Within(1, 100_000)]


@dataclass(frozen=True, kw_only=True)
class Config(SoftActorCriticConfig, SwarmConfig):
    """Hyperparameters of `coadaptation`: of soft actor-critic, of the swarm, and of how they take turns."""

    batch_size: BatchSteps = 1_000
    """Environment steps between two rounds of updates; episodes are finished."""
    initial_designs: Annotated[int, Within(1, 10_000)] = 5
    """Tools that are tried before the first search."""
    initial_design_episodes: Episodes = field(default=300, metadata={"search": Integer(50, 500, log=True)})
    """Episodes with each of them."""
    design_episodes: Episodes = field(default=100, metadata={"search": Integer(20, 300, log=True)})
    """Episodes with each later tool."""
    individual_updates: UpdatesPerStep = field(default=0.2, metadata={"search": LogUniform(0.05, 1.0)})
    """Gradient steps of the individual networks per environment step."""
    population_updates: UpdatesPerStep = field(default=0.05, metadata={"search": LogUniform(0.01, 0.25)})
    """Gradient steps of the population networks per environment step."""
    current_share: Share = 0.9
    """Share of an individual minibatch that was played with the current tool; the rest is drawn from all."""
    replay_size: Annotated[int, Within(1, 10_000_000)] = 200_000
    """Capacity of the replay buffer, transitions."""
    stored_starts: Annotated[int, Within(1, 10_000)] = 32
    """Starts of earlier episodes on which a search compares tools."""

    def __post_init__(self) -> None:
        check_values(self)


TUNED: Tuned = {
    "laptop": {"hidden": (128, 128)},
    "quick": {"initial_design_episodes": 60, "design_episodes": 30},
}
"""Settings chosen for time: networks a quarter of the source's in work, and enough tools in a short budget (ours)."""


class ToolAndActor(nn.Module):
    """A tool for all goals, and an actor that was trained for it."""

    unit_design: Tensor

    def __init__(self, task: Task, actor: SquashedActor) -> None:
        super().__init__()
        self.register_buffer("unit_design", torch.zeros(task.design_space.size))
        self.actor = actor

    def policy(self) -> Policy:
        """Return the policy that builds the tool and acts with the actor's means."""
        return NetworkPolicy(self, self.design, self.actor.control)

    def design(self, observation: Tensor) -> Tensor:
        """Return the tool (B, D) for observations (B, O), whatever they are."""
        return self.unit_design.expand(len(observation), -1)


class Coadaptation(Method[Config]):
    """A tool for all goals by particle swarm on the population's critic, with soft actor-critic for its control."""

    name = "coadaptation"
    label = "co-adaptation"
    tool_per_goal = False
    config_class: ClassVar[type] = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        task = problem.task
        self.individual, self.population = (
            SoftActorCritic(task, config, streams[f"{kind} actor weights"], streams[f"{kind} critic weights"])
            for kind in ("individual", "population")
        )
        self.individual.start_from(self.population)
        self.current = ToolAndActor(task, self.individual.actor)
        self.best = ToolAndActor(task, SquashedActor(task, config.hidden, np.random.default_rng(0)))
        self.best_return: float | None = None
        """Mean return that decided for the best tool; None: no tool has been given up yet."""
        self.buffer = ReplayBuffer(config.replay_size, task)
        self.collector = BatchCollector(problem, streams)
        self.env_steps = 0
        self.designs = 1
        """Tools so far, the current one included."""
        self.returns: list[float] = []
        """Of the episodes with the current tool."""
        self.own_steps = 0
        """Transitions with the current tool."""

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes, small networks, and a new tool after every batch."""
        return {
            "batch_size": 300,
            "minibatch_size": 32,
            "individual_updates": 0.02,
            "population_updates": 0.02,
            "replay_size": 2_000,
            "hidden": (16, 16),
            "initial_designs": 2,
            "initial_design_episodes": 2,
            "design_episodes": 2,
            "swarm_size": 5,
            "swarm_iterations": 3,
        }

    @classmethod
    def profile(cls, profile: str, task_name: str) -> Settings:
        """Return the settings tuned for this method."""
        return tuned(profile, TUNED)

    def use_cores(self, count: int) -> None:
        """Play episodes in up to `count` processes."""
        self.collector.use_cores(count)

    def train(self, remaining_steps: int) -> BatchReport:
        """Play a batch with the current tool, learn from the buffer, and change the tool when its episodes are over."""
        batch = self._collect(remaining_steps)
        metrics = batch.summary() | {"designs": float(self.designs)}
        transitions = Transitions.of(batch)
        # The choice of a tool is no transition: the critic values controls, and the swarm is the designer.
        self.buffer.add(transitions.rows(np.flatnonzero(~transitions.is_design)))
        self.own_steps += int((~transitions.is_design).sum())
        self.env_steps += batch.env_steps
        self.returns += [float(value) for slot in batch.episode_returns for value in slot]
        metrics |= self._learn(batch.env_steps)
        episodes = self._initial(self.config.initial_design_episodes, self.config.design_episodes)
        if len(self.returns) >= episodes:
            metrics |= self._next_tool()
        return BatchReport(batch.env_steps, metrics, self._updates(self.config.individual_updates, batch.env_steps))

    def _collect(self, remaining_steps: int) -> Trajectories:
        steps = min(self.config.batch_size, remaining_steps)
        slots = slots_for(steps, self.problem.task.horizon + 1)
        designs = self.current.unit_design.numpy()[None].repeat(slots, axis=0)
        explorer = FixedDesigns(SquashedExplorer(self.individual.actor), Trial(designs))
        return self.collector.collect(explorer, steps, slots, most_steps(self.env_steps, remaining_steps))

    def _learn(self, env_steps: int) -> dict[str, float]:
        """Update the networks after a batch of `env_steps` steps; return the logged values."""
        config, scale = self.config, self.reward_scale()
        updates = range(self._updates(config.individual_updates, env_steps))
        logged = _means([self._learn_individual(scale) for _ in updates])
        if self.designs > POPULATION_AFTER:
            updates = range(self._updates(config.population_updates, env_steps))
            of_population = _means([self._learn_population(scale) for _ in updates])
            logged |= {f"population_{name}": value for name, value in of_population.items()}
        return logged | {"reward_scale": scale}

    def _updates(self, per_step: float, env_steps: int) -> int:
        return max(1, round(per_step * env_steps))

    def _initial(self, initial: int, later: int) -> int:
        return initial if self.designs <= self.config.initial_designs else later

    def reward_scale(self) -> float:
        """Return the root mean square of all rewards in the buffer: what the networks learn as a reward of one.

        The entropy's weight is in units of a reward. It is the source's, where a step earns about one.
        """
        return float(np.sqrt((self.buffer.held.reward**2).mean())) or 1.0

    def _learn_individual(self, scale: float) -> dict[str, float]:
        rng, count = self.streams["individual updates"], self.config.minibatch_size
        own = round(self.config.current_share * count)
        batch = self.buffer.sample(own, rng, self.own_steps).followed_by(self.buffer.sample(count - own, rng))
        return self.individual.update(replace(batch, reward=batch.reward / np.float32(scale)), rng)

    def _learn_population(self, scale: float) -> dict[str, float]:
        rng = self.streams["population updates"]
        batch = self.buffer.sample(self.config.minibatch_size, rng)
        return self.population.update(replace(batch, reward=batch.reward / np.float32(scale)), rng)

    def _next_tool(self) -> dict[str, float]:
        """Give up the current tool, and take the next one with the population's networks; return the logged values."""
        self.keep_the_better()
        # After the initial tools, searched and random ones take turns: without random ones, the critic would hear only
        # of tools that it already likes.
        searched = self.designs >= self.config.initial_designs
        searched = searched and (self.designs - self.config.initial_designs) % 2 == 0
        size, metrics = self.problem.task.design_space.size, {}
        if searched:
            found = maximize(self.promised(self.starts()), size, self.config, self.streams["swarm"])
            design, metrics = found.position, {"promised_value": found.value * self.reward_scale()}
        else:
            design = self.streams["random designs"].uniform(-1.0, 1.0, size)
        self.current.unit_design.copy_(torch.from_numpy(design))
        self.individual.start_from(self.population)
        self.designs, self.returns, self.own_steps = self.designs + 1, [], 0
        return metrics

    def keep_the_better(self) -> None:
        """Act with the current tool and its actor from now on, if they have earned more than the best so far."""
        # Of a tool's episodes, the later half: by then the individual networks have adapted to it.
        earned = float(np.mean(self.returns[len(self.returns) // 2 :]))
        if self.best_return is None or earned > self.best_return:
            self.best_return = earned
            self.best.load_state_dict(self.current.state_dict())

    def starts(self) -> Tensor:
        """Return observations (K, O) of first control steps, drawn from those in the buffer."""
        elapsed = self.problem.task.layout.phase.stop - 1
        observation = self.buffer.held.observation
        starts = np.flatnonzero(observation[:, elapsed] == 0.0)
        return torch.from_numpy(observation[self.streams["starts"].choice(starts, self.config.stored_starts)])

    def promised(self, starts: Tensor) -> Fitness:
        """Return the function from designs (P, D) to the mean value (P,) of `starts` (K, O), in units of its scale."""
        place = self.problem.task.layout.design

        def values(designs: Floats) -> Floats:
            seen = starts.repeat(len(designs), 1)
            seen[:, place] = torch.from_numpy(designs.astype(np.float32)).repeat_interleave(len(starts), dim=0)
            with torch.inference_mode():
                control = self.population.actor.control(seen)
                value = self.population.critic(seen, control).amin(0).view(len(designs), -1).mean(1)
            found: Floats = value.double().numpy()
            return found

        return values

    def policy(self) -> Policy:
        """Return the best tool that has been given up, with its actor; before there is one, the current tool."""
        return (self.current if self.best_return is None else self.best).policy()

    @classmethod
    def make_policy(cls, task: Task, config: Config, tensors: Mapping[str, Any]) -> Policy:
        """Return the tool and the actor with the given parameters."""
        made = ToolAndActor(task, SquashedActor(task, config.hidden, np.random.default_rng(0)))
        load_module_arrays(made, tensors)
        return made.policy()

    def state(self) -> State:
        """Return networks, optimizers, tools and returns, and the replay buffer as large state."""
        values = {
            "env_steps": self.env_steps,
            "designs": self.designs,
            "returns": list(self.returns),
            "own_steps": self.own_steps,
            "best_return": self.best_return,
        }
        return State(learner_arrays(self._modules(), self._optimizers()), values, self.buffer.arrays())

    def load_state(self, state: State) -> None:
        """Resume from `state`."""
        load_learner_arrays(self._modules(), self._optimizers(), state.arrays)
        self.buffer.load(state.large)
        self.env_steps, self.designs, self.own_steps = (
            int(state.values[name]) for name in ("env_steps", "designs", "own_steps")
        )
        self.returns, self.best_return = list(state.values["returns"]), state.values["best_return"]

    def _learners(self) -> dict[str, SoftActorCritic]:
        return {"individual": self.individual, "population": self.population}

    def _modules(self) -> dict[str, nn.Module]:
        networks = {
            f"{kind} {name}": network for kind, own in self._learners().items() for name, network in own.modules.items()
        }
        return {**networks, "current": self.current, "best": self.best}

    def _optimizers(self) -> dict[str, torch.optim.Optimizer]:
        return {f"{kind} {name}": one for kind, own in self._learners().items() for name, one in own.optimizers.items()}


def _means(losses: list[dict[str, float]]) -> dict[str, float]:
    return {name: float(np.mean([loss[name] for loss in losses])) for name in losses[0]}
