"""Look for better episodes of every evaluation instance: in policies, in their headroom, and by a search of one's own.

The search is over the design and the open-loop controls of one instance at a time. It starts from the best that is
known of it and of the instances nearest to it, and so from what any policy at hand does there. CMA-ES then moves the
design and bends the controls by a few knots, between which changes are linear (ours). Whoever found an episode, it
counts only once its plan has been played again.

Shapes: `N` evaluation instances, `b` plans, `X` numbers of a plan, `K` knots, `H` horizon, `C` control, `D` design.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from codesign_bench.cell.axes import keeps_returns
from codesign_bench.config.values import Within
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.evaluation.expected import Work, steps_per_second
from codesign_bench.evaluation.headroom import DESIGNER, SearchBudget, Sigma, fingerprint
from codesign_bench.evaluation.plans import plans_of, replay
from codesign_bench.learning.cma_es import Evolution, EvolutionConfig
from codesign_bench.seeding import generator
from codesign_bench.storage.best_known import BestKnown, Episode, load_best_known, store
from codesign_bench.storage.cells import StoredCell
from codesign_bench.storage.headroom import of_cell
from codesign_bench.storage.policies import misfit, policy_of
from codesign_bench.storage.reading import UnusableFile
from codesign_bench.task import EVALUATION_SEED, Behaviour, Booleans, Floats, Singles, Slots, Task
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import portions
from codesign_bench.task.plans import controls_of, designs_of, plan_size
from codesign_bench.task.simulators import Simulators

SEARCH, SCRIPT = "search", "script"
"""Who found an episode, if it was no cell."""

SAME = 1e-6
"""Relative difference of returns below which a stored one is not worth playing again: it may be one of rounding."""


@dataclass(frozen=True, kw_only=True)
class Search(SearchBudget):
    """What a search of plans spends on every instance."""

    sigma0: Sigma = 0.1
    """Initial standard deviation, of designs and of changes of controls; both are in [-1, 1]."""
    knots: Annotated[int, Within(1, 1_000)] = 8
    """K: times at which controls are changed."""
    neighbours: Annotated[int, Within(0, 1_000)] = 8
    """Nearest instances whose best plans are tried first."""


@dataclass
class Update:
    """One update of what is known of a task."""

    task: Task
    known: BestKnown
    simulators: Simulators = field(init=False)
    improved: set[int] = field(default_factory=set)
    """Instances of which something better was found."""
    env_steps: int = 0
    """Taken so far, those of playing again included."""

    def __post_init__(self) -> None:
        self.simulators = Simulators(self.task)
        self.instances = self.task.evaluation_instances()

    def play(self, behaviour: Behaviour, indices: Slots) -> Singles:
        """Play a behaviour on instances (b,), and return the plans (b, X) that it made of them."""
        found = evaluate(self.task, behaviour, instances=self.instances[indices], simulators=self.simulators)
        self.env_steps += int(found.lengths.sum()) + len(indices)
        return plans_of(found)

    def judge(self, plans: Singles, indices: Slots, source: str) -> list[Episode]:
        """Play plans (b, X) on instances (b,) and return the episodes."""
        found = replay(self.task, plans, self.instances[indices], self.simulators)
        self.env_steps += int(found.lengths.sum()) + len(indices)
        outcomes = zip(indices, found.returns, found.successes, found.lengths, plans, strict=True)
        return [
            Episode(int(index), float(earned), bool(solved), int(length), source, plan)
            for index, earned, solved, length, plan in outcomes
        ]

    def offer(self, plans: Singles, indices: Slots, source: str) -> None:
        """Play plans (b, X) again on their instances (b,), and take over those that are better than what is known."""
        if len(indices):
            for episode in self.judge(plans, indices, source):
                if self.known.offer(episode):
                    self.improved.add(episode.instance)


def update(
    results: Path,
    task: Task,
    cells: Sequence[StoredCell],
    search: Search,
    log: Log,
    *,
    instances: int | None = None,
) -> Update:
    """Renew the best known episodes of a task; what is known is only ever replaced by what is better.

    Args:
        results: the folder of the table, and of the tables of headroom.
        task: whose instances they are.
        cells: finished cells; those of other tasks, or without a policy that can be played, are passed over.
        search: what is spent on every instance after the cells.
        log: shows what is played and what came of it.
        instances: search only for so many, those that were searched for least; None: all.

    Raises:
        UserError: the folder is not writable, or its table cannot be used.
    """
    state = Update(task, load_best_known(results, task))
    everywhere = np.arange(len(state.instances))
    try:
        script = task.script()
    except UserError:
        pass
    else:
        state.offer(state.play(script, everywhere), everywhere, SCRIPT)
    own = [cell for cell in cells if cell.record.task == task.name and cell.is_done]
    stored = [cell for cell in own if cell.has_policy]
    for cell in stored:
        _take_from(cell, results, state, log)
    if state.known.episodes:
        store(results, task, state.known)
    better, many = len(state.improved), len(everywhere)
    without = f"; {len(own) - len(stored)} cells have none" if len(own) > len(stored) else ""
    log(f"{task.name}: better episodes of {better} of {many} instances by {len(stored)} policies at hand{without}")
    if search.candidates >= search.popsize:
        _search(results, state, search, log, instances)
    return state


def expected_work(task: Task, cells: Sequence[StoredCell], search: Search, *, instances: int | None = None) -> Work:
    """Return what `update` would play, with the same arguments; policies take some time in addition."""
    count = task.num_evaluation_instances
    own = [cell for cell in cells if cell.record.task == task.name and cell.is_done and cell.has_policy]
    # The script and each policy are played once and played again, and so is the best tool of its headroom.
    episodes = count * (2 + 4 * len(own))
    if search.candidates >= search.popsize:
        searched = count if instances is None else min(instances, count)
        candidates = search.candidates // search.popsize * search.popsize
        episodes += searched * (1 + min(search.neighbours, count - 1) + candidates + 2)
    return Work(task, episodes, steps_per_second(task))


def _take_from(cell: StoredCell, results: Path, state: Update, log: Log) -> None:
    """Play a cell's policy where it may be better than what is known, with its own tools and with those of headroom."""
    task, source = state.task, cell.name
    try:
        reason, own = misfit(cell), cell.evaluation()
    except UserError as error:
        reason, own = str(error), None
    if reason or own is None:
        log(f"passed over {source}: {reason}")
        return
    policy, indices = policy_of(cell), np.arange(len(state.instances))
    if _tells_returns(state, cell, own):
        indices = indices[_promising(state, indices, own["return"], own["success"])]
    if len(indices):
        state.offer(state.play(policy, indices), indices, source)
    if not keeps_returns(cell.record.variant):  # what was searched for is another reward
        return
    try:
        table = of_cell(results, cell.record, fingerprint(cell))
    except UnusableFile:
        return  # `survey` names it
    if table is None:
        return
    table = table[table["found_by"] != DESIGNER]
    chosen = table[_promising(state, table["instance"], table["best_return"], table["best_success"])]
    if len(chosen):
        indices = chosen["instance"].to_numpy(dtype=np.intp)
        designs = chosen[[f"design_{name}" for name in task.design_space.names]].to_numpy(dtype=np.float64)
        tools = task.design_space.to_unit(designs)
        for part in portions(len(indices), task):  # a tool per episode needs all episodes of a part at once
            played = state.play(GivenDesigns(tools[part], policy), indices[part])
            state.offer(played, indices[part], f"{source}, another tool")


def _tells_returns(state: Update, cell: StoredCell, own: pd.DataFrame) -> bool:
    """Return whether a cell's evaluation tells what it earns on the task's instances by the task's own reward."""
    names = [f"instance_{name}" for name in state.task.instance_space.names]
    return (
        keeps_returns(cell.record.variant)
        and len(own) == len(state.instances)
        and set(names) <= set(own.columns)
        and np.allclose(own[names], state.instances)
    )


def _promising(state: Update, indices: Iterable[int], returns: Iterable[float], successes: Iterable[float]) -> Booleans:
    """Return (b,) which of these outcomes are better than what is known of their instances."""
    nothing = np.zeros(0, dtype=np.float32)
    return np.array(
        [
            Episode(index, earned - SAME * max(1.0, abs(earned)), success == 1.0, 0, "", nothing).adds_to(
                state.known.episodes.get(index, [])
            )
            for index, earned, success in zip(indices, returns, successes, strict=True)
        ],
        dtype=bool,
    )


def _search(results: Path, state: Update, search: Search, log: Log, instances: int | None) -> None:
    """Search for better plans, instance by instance, those first that were searched for least; store each."""
    known, count = state.known, len(state.instances)
    order = sorted(range(count), key=lambda index: (known.searched.get(index, 0), index))[:instances]
    log(f"{state.task.name}: searching designs and controls for {len(order)} instances")
    near = _neighbours(state, search.neighbours)
    for index in order:
        before = known.best(index)
        # The stream depends on what was spent before, so that another search of an instance tries other plans.
        spent = known.searched.get(index, 0)
        rng = generator(EVALUATION_SEED, f"best known of {state.task.name} on instance {index} after {spent}")
        tried = list(_tried(state, index, near[index], search, rng))
        best = max(tried, key=lambda episode: episode.earned)
        solving = max((one for one in tried if one.solved), key=lambda episode: episode.earned, default=best)
        for episode in {one.name: one for one in (best, solving)}.values():
            state.offer(episode.plan[None], np.array([index]), SEARCH)
        known.searched[index] = spent + len(tried)
        store(results, state.task, known)
        now = known.best(index)
        if now is not None and (before is None or now.earned > before.earned):
            former = "nothing" if before is None else f"{before.earned:.3f}"
            log(f"  instance {index}: {former} -> {now.earned:.3f}{' (solved)' if now.solved else ''}")


def _neighbours(state: Update, count: int) -> list[Slots]:
    """Return the nearest other instances of each; every entry of an instance is scaled by its range among them."""
    places = np.asarray(state.instances, dtype=np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    places = (places - low) / np.where(high > low, high - low, 1.0)
    gaps = np.linalg.norm(places[:, None] - places[None], axis=-1)
    np.fill_diagonal(gaps, np.inf)
    return list(np.argsort(gaps, axis=1, kind="stable")[:, : min(count, len(places) - 1)])


def _tried(state: Update, index: int, near: Slots, search: Search, rng: np.random.Generator) -> Iterator[Episode]:
    """Yield the plans that are tried on an instance: what is known of it and around it, then CMA-ES from the best."""
    starts = [episode.plan for other in (index, *near) if (episode := state.known.best(int(other))) is not None]
    base = _Bent(state.task, search.knots)
    if not starts:
        starts = [rng.uniform(-1.0, 1.0, plan_size(state.task)).astype(np.float32)]
    best = None
    for episode in state.judge(np.stack(starts), np.full(len(starts), index), SEARCH):
        best = episode if best is None or episode.earned > best.earned else best
        yield episode
    assert best is not None
    config = EvolutionConfig(popsize=search.popsize, sigma0=search.sigma0)
    evolution, around = Evolution(base.size, config, rng, base.start(best.plan)), best.plan
    for _ in range(search.candidates // search.popsize):
        if evolution.converged:  # on from the best, with large steps again
            evolution, around = Evolution(base.size, config, rng, base.start(best.plan)), best.plan
        plans = base.plans(around, evolution.ask())
        episodes = state.judge(plans, np.full(len(plans), index), SEARCH)
        evolution.tell(np.array([episode.earned for episode in episodes]))
        best = max([best, *episodes], key=lambda episode: episode.earned)
        yield from episodes


class _Bent:
    """Plans around a given one: another design, and controls that are changed at a few knots.

    Searching X numbers one by one would take far more episodes than there are; a few knots move whole stretches.
    """

    def __init__(self, task: Task, knots: int) -> None:
        self.task = task
        steps, self.knots = np.arange(task.horizon), min(knots, task.horizon)
        places = np.linspace(0.0, task.horizon - 1.0, self.knots)
        self.weights = np.stack([np.interp(steps, places, unit) for unit in np.eye(self.knots)], axis=1)
        """(H, K) what a change at each knot is at each step."""

    @property
    def size(self) -> int:
        """Numbers that are searched: a design, and a change of each control at each knot."""
        return self.task.design_space.size + self.knots * self.task.control_space.size

    def start(self, plan: Singles) -> Floats:
        """Return the numbers that change nothing of a plan (X,)."""
        start = np.zeros(self.size)
        start[: self.task.design_space.size] = designs_of(self.task, plan)
        return start

    def plans(self, plan: Singles, numbers: Floats) -> Singles:
        """Return the plans (b, X) of numbers (b, size) around a plan (X,)."""
        count, size = len(numbers), self.task.design_space.size
        controls = controls_of(self.task, plan[None])
        changes = numbers[:, size:].reshape(count, self.knots, self.task.control_space.size)
        bent = np.clip(controls + np.einsum("hk,bkc->bhc", self.weights, changes), -1.0, 1.0)
        return np.concatenate([numbers[:, :size], bent.reshape(count, -1)], axis=1).astype(np.float32)
