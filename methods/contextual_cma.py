"""Contextual CMA-ES over designs outside, PPO for a design-conditioned controller inside.

Source: contextual CMA-ES is that of Abdolmaleki et al. (IJCAI 2017); that it searches tools beside a learned controller
is ours. It differs from `cma_rl` in one thing: the mean of the search is a function of what the designer observes, so
there is a tool for every goal. No gradient, and no network, is behind the design.

Shapes: `b` slots, `B` batch, `O` observation, `D` design, `Z` noise, `n` episodes of a batch, `f` features.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar

import numpy as np
import torch
from torch import Tensor

from codesign_bench.config.search import Integer, LogUniform
from codesign_bench.config.values import Within
from codesign_bench.learning.checkpointing import below, prefixed
from codesign_bench.learning.contextual_cma import ContextFeatures, Distribution, mean_of
from codesign_bench.learning.explorer import Explorer, Sample
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.method import BatchReport, Problem, State
from codesign_bench.seeding import Streams
from codesign_bench.task import Floats, Singles, Slots, Task

from ._given_design import WITHOUT_EFFECT, GivenDesignActor, GivenDesignMethod

SEARCH = "search."
"""Prefix of the distribution's arrays in the state."""
GATHERED = "gathered."
"""Prefix of the arrays of the generation's episodes so far."""


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `contextual_cma`: PPO's and the perceptrons' for the controller, and the search's."""

    not_searched: ClassVar = WITHOUT_EFFECT
    """Contextual CMA-ES moves the designs."""
    sigma0: Annotated[float, Within(1e-12, 10.0)] = field(default=0.4, metadata={"search": LogUniform(0.05, 0.6)})
    """Initial standard deviation of designs; parameters are in [-1, 1]."""
    samples_per_feature: Annotated[int, Within(1, 1_000)] = field(default=4, metadata={"search": Integer(2, 12)})
    """Episodes of a generation for each feature that varies: a regression on fewer follows their noise."""


class ContextualActor(GivenDesignActor):
    """A design that is a function of the features of state and goal, and a perceptron that controls any design."""

    weights: Tensor

    def __init__(self, task: Task, config: PerceptronConfig, rng: np.random.Generator) -> None:
        super().__init__(task, config, rng)
        self.of_context = ContextFeatures(task.state_space, task.goal_space)
        shape = self.of_context.size, task.design_space.size
        self.register_buffer("weights", torch.zeros(shape, dtype=torch.float64))

    def context(self, observation: Singles) -> Floats:
        """Return the features (n, f) of design steps' observations (n, O)."""
        return self.of_context(observation[:, : self.features.size].astype(np.float64))

    def design(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        """Return the mean design (B, D) for observations (B, O), with standard deviation 0."""
        mean = mean_of(self.context(observation.numpy()), self.weights.numpy())
        return torch.from_numpy(mean.astype(np.float32)), self.design_log_std


class AroundTheMean(Explorer):
    """Another explorer's controls with designs drawn from a search distribution."""

    def __init__(self, explorer: Explorer, actor: ContextualActor, search: Distribution) -> None:
        super().__init__(explorer.design_noise, explorer.control_noise)
        self.explorer, self.actor, self.search, self.root = explorer, actor, search, search.root()

    def sample_design(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return designs (b, D) around the means for their observations (b, O)."""
        mean = self.search.mean(self.actor.context(observation))
        return Sample((mean + noise @ self.root.T).astype(np.float32))

    def sample_control(self, slots: Slots, observation: Singles, noise: Singles) -> Sample:
        """Return the other explorer's controls."""
        return self.explorer.sample_control(slots, observation, noise)


class ContextualCma(GivenDesignMethod[Config]):
    """A search distribution over designs whose mean depends on the goal, with PPO for the controller inside."""

    name = "contextual_cma"
    label = "contextual CMA-ES"
    config_class = Config
    actor_class = ContextualActor
    actor: ContextualActor

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        size = problem.task.design_space.size
        self.search = Distribution.start(self.actor.of_context.size, size, config.sigma0)
        self._gathered = self._nothing()

    def _nothing(self) -> dict[str, Floats]:
        """Return features (n, f), designs (n, D) and returns (n,) of no episodes."""
        sizes = {"features": (0, self.actor.of_context.size), "designs": (0, self.search.path.size), "returns": (0,)}
        return {name: np.zeros(shape) for name, shape in sizes.items()}

    def give_designs(self, explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
        """Draw a design for every episode."""
        return AroundTheMean(explorer, self.actor, self.search), slots

    def train(self, remaining_steps: int) -> BatchReport:
        """Play a batch and update the controller on it; at the end of a generation, move the search."""
        report, batch = self.learner.train(remaining_steps)
        starts = batch.is_design & batch.valid
        played = {
            "features": self.actor.context(batch.observation[starts]),
            "designs": batch.design[starts].astype(np.float64),
            # Slot after slot, and in each slot one episode after the other: the order of `starts`, too.
            "returns": np.concatenate(batch.episode_returns),
        }
        self._gathered = {name: np.concatenate([self._gathered[name], played[name]]) for name in played}
        varying = 1 + int((np.ptp(self._gathered["features"], axis=0) > 0.0).sum())
        if len(self._gathered["returns"]) >= self.config.samples_per_feature * varying:
            self.search.update(*(self._gathered[name] for name in ("features", "designs", "returns")))
            self.actor.weights.copy_(torch.from_numpy(self.search.weights))
            self._gathered = self._nothing()
        logged = {"generations": float(self.search.generations), "sigma": self.search.sigma}
        return replace(report, metrics={**report.metrics, **logged, "design_std": self._design_std()})

    def _design_std(self) -> float:
        """Return the mean standard deviation of a design parameter."""
        return float(self.search.sigma * np.sqrt(np.diag(self.search.covariance)).mean())

    def state(self) -> State:
        """Return the learner's state, the rest of the search distribution, and the generation's episodes so far."""
        state, search = super().state(), self.search
        paths = {name: getattr(search, name) for name in ("covariance", "path", "sigma_path")}
        arrays = {**state.arrays, **prefixed(SEARCH, paths), **prefixed(GATHERED, self._gathered)}
        return State(arrays, {**state.values, "sigma": search.sigma, "generations": search.generations})

    def load_state(self, state: State) -> None:
        """Restore the learner's state and the search distribution."""
        super().load_state(state)
        self._gathered, paths = (
            {name: np.array(array) for name, array in below(prefix, state.arrays).items()}
            for prefix in (GATHERED, SEARCH)
        )
        sigma, generations = float(state.values["sigma"]), int(state.values["generations"])
        # The actor has the weights of the mean: it acts with them.
        weights = self.actor.weights.numpy().copy()
        self.search = Distribution(weights, sigma=sigma, generations=generations, **paths)
