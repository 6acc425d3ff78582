"""Bayesian optimisation of one design outside, PPO for its controller inside.

Source: the outer loop of Bhatia et al. (2021, "Evolution Gym"), whose every candidate gets a controller that is trained
anew. That a part of the budget is kept to train the winner is ours.

Shapes: `n` candidates, `S` slots, `E` episodes of a slot, `K` instances, `D` design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from codesign_bench.config.search import Integer, Uniform
from codesign_bench.config.values import Within
from codesign_bench.errors import UserError
from codesign_bench.learning.actor import ActorPolicy
from codesign_bench.learning.bayesian import first_points, next_point
from codesign_bench.learning.checkpointing import below, load_module_arrays, prefixed
from codesign_bench.learning.explorer import Explorer, FixedDesigns, Trial
from codesign_bench.learning.ppo_config import PerceptronConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.method import Array, BatchReport, Policy, Problem, State
from codesign_bench.seeding import Streams

from ._given_design import WITHOUT_EFFECT, GivenDesignMethod

JUDGING_INSTANCES = 1_024
"""Instances on which candidates are judged, taken in turn."""
WINNER = "winner."
"""Prefix of the arrays of the best candidate's learner in the state."""


@dataclass(frozen=True, kw_only=True)
class Config(PerceptronConfig):
    """Hyperparameters of `bo_rl`: PPO's and the perceptrons' for controllers, and how the budget is split."""

    not_searched: ClassVar = WITHOUT_EFFECT
    """Bayesian optimisation chooses the designs."""
    candidates: Annotated[int, Within(2, 10_000)] = field(default=12, metadata={"search": Integer(6, 24, log=True)})
    """Designs that are tried."""
    first_candidates: Annotated[int, Within(2, 10_000)] = 4
    """Designs of these that a Latin hypercube chooses, before there is anything to learn from."""
    search_share: Annotated[float, Within(0.01, 1.0)] = field(default=0.7, metadata={"search": Uniform(0.3, 0.9)})
    """Share of the budget that all candidates use; the rest trains the controller of the best."""


class BoRl(GivenDesignMethod[Config]):
    """Bayesian optimisation over one design for all goals, and PPO for a controller of each candidate."""

    name = "bo_rl"
    label = "BO-RL"
    tool_per_goal = False
    config_class = Config

    def __init__(self, problem: Problem, config: Config, streams: Streams) -> None:
        super().__init__(problem, config, streams)
        self._device = "cpu"
        self._cores = 1
        size = problem.task.design_space.size
        self._instances = problem.sample_instances(streams["judging instances"], JUDGING_INSTANCES)
        self._first = first_points(config.first_candidates, size, streams["designs"])
        self._best_actor = self.actor_class(problem.task, config, np.random.default_rng(0))
        self.designs = self._first[:0]
        """(n, D) of the candidates that have been judged."""
        self.scores: list[float] = []
        """Mean return of each."""
        self._budget = 0
        self._left = 0
        """Steps that the candidate has left; 0: it has not begun."""
        self._judged_now = False
        self._winner: dict[str, Array] = {}
        self._searching = True
        self.actor.act_with(self._first[0])

    @classmethod
    def small(cls) -> Mapping[str, Any]:
        """Return batches of a few episodes, small networks and few candidates, each of them for one batch."""
        return {**super().small(), "candidates": 4, "first_candidates": 2, "search_share": 0.1}

    @classmethod
    def check(cls, config: Config, task_name: str) -> None:
        """Check that no more candidates are chosen first than there are.

        Raises:
            UserError: they are.
        """
        if config.first_candidates > config.candidates:
            raise UserError(f"first_candidates is {config.first_candidates}, candidates only {config.candidates}")

    def use_cores(self, count: int) -> None:
        """Use up to `count` cores, also for candidates to come."""
        self._cores = count
        super().use_cores(count)

    def use_device(self, name: str) -> None:
        """Update the networks on the device `name`, also those of candidates to come."""
        self._device = name
        super().use_device(name)

    def give_designs(self, explorer: Explorer, steps: int, slots: int) -> tuple[Explorer, int]:
        """Give every slot the candidate; in the batch that judges it, on the instances that judge all candidates."""
        design = self.actor.best_design.numpy()
        instances = None
        if self._judged_now:
            most = steps // slots // 2 + 1  # An episode has a design step and a control step at least.
            taken = np.arange(slots * most) % JUDGING_INSTANCES
            instances = self._instances[taken].reshape(slots, most, -1)
        return FixedDesigns(explorer, Trial(design[None].repeat(slots, axis=0), instances)), slots

    def train(self, remaining_steps: int) -> BatchReport:
        """Train the candidate's controller for a batch; if its share is used up, judge it and choose the next.

        After the search, train the controller of the best candidate.
        """
        self._budget = self._budget or remaining_steps
        if not self._searching:
            report = self.learner.train(remaining_steps)[0]
        else:
            if self._left == 0:
                self._left = self._share(remaining_steps)
            self._judged_now = self._left <= self.config.batch_size
            report, batch = self.learner.train(min(self._left, remaining_steps))
            if self._judged_now:
                self._judge(batch, remaining_steps - report.env_steps)
            else:
                # Whole episodes may pass the share. The candidate is then judged by the shortest batch that there is.
                self._left = max(1, self._left - report.env_steps)
        logged = {"candidates": float(len(self.scores))}
        if self.scores:
            logged |= {"candidate_score": self.scores[-1], "best_score": max(self.scores)}
        return replace(report, metrics=report.metrics | logged)

    def _share(self, remaining_steps: int) -> int:
        """Return the steps of the candidate that begins now: an equal part of what the search has left."""
        return max(1, (remaining_steps - self._rest) // (self.config.candidates - len(self.scores)))

    @property
    def _rest(self) -> int:
        """Steps of the budget that are not for the search."""
        return self._budget - int(self.config.search_share * self._budget)

    def _judge(self, batch: Trajectories, remaining_steps: int) -> None:
        """Give the candidate its score; begin the next, or go on with the best."""
        score = float(np.concatenate(batch.episode_returns).mean())
        if not self.scores or score > max(self.scores):
            self._keep(self.learner.state().arrays)
        self.designs = np.concatenate([self.designs, self.actor.best_design.numpy()[None].astype(np.float64)])
        self.scores.append(score)
        self._left, self._judged_now = 0, False
        tried = len(self.scores)
        self._searching = tried < self.config.candidates and remaining_steps > self._rest
        self._begin_learner()
        if not self._searching:
            self.learner.load_state(State(self._winner, {"env_steps": 0}))
        elif tried < len(self._first):
            self.actor.act_with(self._first[tried])
        else:
            self.actor.act_with(next_point(self.designs, np.array(self.scores), self.streams["designs"]))

    def _keep(self, winner: Mapping[str, Array]) -> None:
        """Take a learner's arrays for those of the best candidate."""
        self._winner = {name: np.array(array) for name, array in winner.items()}
        load_module_arrays(self._best_actor, below("actor.", self._winner))

    def _begin_learner(self) -> None:
        """Replace the learner by a new one with new networks, on the same simulators and processes."""
        collector = self.learner.collector
        self.make_learner()
        self.learner.collector = collector
        self.learner.use_device(self._device)
        self.learner.loop.use_cores(self._cores)

    def policy(self) -> Policy:
        """Return the best candidate with its controller; before any has been judged, the first."""
        best = self._searching and self.scores
        return ActorPolicy(self._best_actor) if best else self.learner.policy()

    def state(self) -> State:
        """Return the candidate's learner, the candidates so far, and the best of them."""
        state = super().state()
        tried = {"candidates.designs": self.designs, "candidates.scores": np.array(self.scores)}
        winner = prefixed(WINNER, self._winner) if self._searching else {}
        values = {"budget": self._budget, "left": self._left, "searching": self._searching}
        return State({**state.arrays, **tried, **winner}, {**state.values, **values})

    def load_state(self, state: State) -> None:
        """Restore what `state` returned."""
        super().load_state(state)
        self.designs = np.array(state.arrays["candidates.designs"])
        self.scores = np.array(state.arrays["candidates.scores"]).tolist()
        self._budget, self._left = int(state.values["budget"]), int(state.values["left"])
        self._searching = bool(state.values["searching"])
        if winner := below(WINNER, state.arrays):
            self._keep(winner)
