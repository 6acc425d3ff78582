"""Headroom of a policy: what its own controller would earn with other tools (ours).

For every evaluation instance, tools are tried with the policy's controller, acting with its mean: the designer's own,
those that it makes for other instances, random ones, and those of a CMA-ES that starts at the designer's own. The gap
between the best and the designer's own is what the designer misses; what even the best leaves is the controller's.

Shapes: `N` evaluation instances, `P` tools that play one instance, `I` instance, `D` design.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from joblib import Parallel, delayed

from codesign_bench.config.validation import check_values
from codesign_bench.config.values import Within
from codesign_bench.console import Log
from codesign_bench.errors import UserError
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.evaluation.expected import Work, steps_per_second
from codesign_bench.learning.cma_es import Evolution, EvolutionConfig
from codesign_bench.method import Policy, Problem
from codesign_bench.seeding import generator
from codesign_bench.storage.cells import StoredCell, open_cell
from codesign_bench.storage.headroom import QUANTITIES, TOOLS, VALUES_FOLDER, add_rows, path_of, rows_of
from codesign_bench.storage.layout import POLICY_FILE
from codesign_bench.storage.measurements import DESIGN_VALUES
from codesign_bench.storage.policies import policy_of, problem_of
from codesign_bench.task import EVALUATION_SEED, Floats, Singles, Slots
from codesign_bench.task.behaviours import GivenDesigns
from codesign_bench.task.episodes import portions
from codesign_bench.task.play import first_observations

Sigma = Annotated[float, Within(1e-12, 10.0)]
DESIGNER, OTHER, RANDOM, SEARCH = "designer", "another goal", "random", "search"
"""Where a tool comes from."""
UNIT = np.float32
"""Normalised designs are played in single precision, as policies give them."""


@dataclass(frozen=True, kw_only=True)
class SearchBudget:
    """What CMA-ES spends on every instance."""

    candidates: Annotated[int, Within(0, 1_000_000)] = 240
    """Most candidates; generations are whole."""
    popsize: Annotated[int, Within(2, 10_000)] = 12
    """Candidates of a generation."""

    def __post_init__(self) -> None:
        check_values(self)


@dataclass(frozen=True, kw_only=True)
class Budget(SearchBudget):
    """What is tried on every instance in addition to the designer's own tools."""

    sigma0: Sigma = 0.3
    """Initial standard deviation; normalised designs are in [-1, 1]."""
    random_tools: Annotated[int, Within(1, 10_000)] = 8
    """Random tools, uniform in the design space, over whose results the mean is taken."""


@dataclass
class Tried:
    """The tools that played one instance, in the order in which they did."""

    designs: Singles
    """(P, D) in [-1, 1]."""
    returns: Floats
    """(P,)"""
    successes: Floats
    """(P,) 0 or 1."""
    origins: list[str]
    """(P,) where each comes from."""
    env_steps: int

    def of(self, origin: str) -> tuple[Floats, Floats]:
        """Return the returns and the successes of the tools from one place."""
        own = np.array([name == origin for name in self.origins])
        return self.returns[own], self.successes[own]


class Controller:
    """The controller of a finished cell, which plays any tool on any of the cell's evaluation instances."""

    def __init__(self, policy: Policy, problem: Problem) -> None:
        self.policy, self.problem = policy, problem
        self.instances = problem.evaluation_instances()
        """(N, I)"""

    def designs(self) -> Singles:
        """Return the designer's own tool for each instance, (N, D) in [-1, 1]."""
        parts = [
            np.clip(np.asarray(self.policy.design(self.observations(part)), dtype=UNIT), -1.0, 1.0)
            for part in portions(len(self.instances), self.problem.task)
        ]
        return np.concatenate(parts)

    def observations(self, instances: Slots) -> Singles:
        """Return the observations (B, O) of the design phase of the instances with these numbers (B,)."""
        with self.problem.episodes(len(instances)) as episodes:
            return first_observations(episodes, self.instances[instances])

    def play(self, instance: int, designs: Singles) -> tuple[Floats, Floats, int]:
        """Return returns (P,) and successes (P,) of designs (P, D) on an instance, and the environment steps taken."""
        problem, parts = self.problem, []
        for part in portions(len(designs), problem.task):
            where = np.repeat(self.instances[[instance]], len(part), axis=0)
            behaviour = GivenDesigns(designs[part], self.policy)
            parts.append(evaluate(problem.task, behaviour, problem.tradeoff, where, problem.simulators))
        returns = np.concatenate([part.returns for part in parts])
        successes = np.concatenate([part.successes for part in parts]).astype(np.float64)
        # The design step of every episode counts, too.
        return returns, successes, len(designs) + int(sum(part.lengths.sum() for part in parts))


def measure_cell(
    folder: Path, results: Path, budget: Budget, log: Log, *, instances: int | None = None, jobs: int = 1
) -> Path:
    """Measure the instances of a finished cell that its table lacks, and return the table's path.

    Every instance is stored as soon as it is measured; what is stored is never measured again.

    Args:
        folder: of the cell.
        results: the table is kept below this results folder.
        budget: what is tried.
        log: shows what is played.
        instances: only so many, the first; None: all.
        jobs: processes that play side by side; the numbers do not depend on it.

    Raises:
        UserError: the cell has no policy that can be played, the folder cannot be written, or its table is of another
            policy or another budget.
    """
    cell = open_cell(folder)
    policy_name = fingerprint(cell)
    controller = _controller(folder, policy_name)
    path, values_path = path_of(results, cell.record), path_of(results, cell.record, VALUES_FOLDER)
    missing = _missing(cell, policy_name, controller, results, budget, instances)
    if missing:
        work = _work(controller, len(missing), budget, jobs).line()
        log(f"trying other tools on {len(missing)} instances of {cell.name}: {work}; kept in {path}")
        tools = controller.designs()
        calls = (delayed(_measure)(folder, policy_name, tools, index, budget) for index in missing)
        try:
            for row, judged in Parallel(n_jobs=jobs, return_as="generator_unordered")(calls):
                # The row comes last, because it says that the instance is done.
                if judged:
                    add_rows(results, values_path, judged, DESIGN_VALUES)
                add_rows(results, path, [row])
        finally:
            _controller.cache_clear()  # its simulator must not outlive this module, nor take memory any longer
    return path


def expected_work(folder: Path, results: Path, budget: Budget, *, instances: int | None = None, jobs: int = 1) -> Work:
    """Return what `measure_cell` would play, with the same arguments; the policy itself takes some time in addition.

    Raises:
        UserError: as `measure_cell`.
    """
    cell = open_cell(folder)
    policy_name = fingerprint(cell)
    controller = _controller(folder, policy_name)
    return _work(controller, len(_missing(cell, policy_name, controller, results, budget, instances)), budget, jobs)


def _work(controller: Controller, missing: int, budget: Budget, jobs: int) -> Work:
    task, count = controller.problem.task, len(controller.instances)
    generations = budget.candidates // budget.popsize
    episodes = missing * (count + budget.random_tools + generations * budget.popsize)
    return Work(task, episodes, steps_per_second(task), jobs)


def _missing(
    cell: StoredCell, policy_name: str, controller: Controller, results: Path, budget: Budget, instances: int | None
) -> list[int]:
    """Return the instances that the cell's table lacks, the first `instances` of all.

    Raises:
        UserError: the table is of another policy or another budget.
    """
    path, count = path_of(results, cell.record), len(controller.instances)
    known, played = rows_of(path), {"policy": policy_name, "task_version": cell.record.task_version}
    _refuse_other(path, known, {**played, **asdict(budget)})
    values_path = path_of(results, cell.record, VALUES_FOLDER)
    _refuse_other(values_path, rows_of(values_path, DESIGN_VALUES), played)
    done = {row["instance"] for row in known}
    return [index for index in range(count if instances is None else min(instances, count)) if index not in done]


def summary(paths: Sequence[Path]) -> tuple[list[str], list[list[str]]]:
    """Return the header and the rows of a table of means over instances, a row for each stored table.

    Raises:
        UnusableFile: one cannot be used.
    """
    table = []
    for path in paths:
        rows = rows_of(path)
        means = {
            f"{tools}_{quantity}": float(np.mean([row[f"{tools}_{quantity}"] for row in rows]))
            for tools in TOOLS
            for quantity in QUANTITIES
        }
        shown = [f"{means[f'{tools}_return']:.2f} ({means[f'{tools}_success']:.2f})" for tools in TOOLS]
        steps = sum(int(row["env_steps"]) for row in rows)
        table.append([path.stem, str(len(rows)), *shown, f"{steps:,}"])
    titles = ["designer", "best tool found", "best tool of another goal", "random tool"]
    return ["cell", "instances", *titles, "env steps"], table


def fingerprint(cell: StoredCell) -> str:
    """Return what tells a cell's policy from others.

    Raises:
        UserError: it has none.
    """
    policy_of(cell)  # says what is wrong with it
    return f"sha256:{hashlib.sha256((cell.folder / POLICY_FILE).read_bytes()).hexdigest()[:16]}"


def measure_instance(controller: Controller, tools: Singles, index: int, budget: Budget) -> Tried:
    """Try tools on one instance.

    Args:
        controller: plays them.
        tools: (N, D) the designer's own for each instance.
        index: of the instance.
        budget: what is tried in addition to these.
    """
    task = controller.problem.task
    rng = generator(EVALUATION_SEED, f"headroom of {task.name} on instance {index}")
    size = task.design_space.size
    own, others = tools[[index]], np.unique(np.delete(tools, index, axis=0), axis=0)
    random = rng.uniform(-1.0, 1.0, (budget.random_tools, size)).astype(UNIT)
    designs = np.concatenate([own, others, random])
    origins = [DESIGNER, *[OTHER] * len(others), *[RANDOM] * len(random)]
    returns, successes, env_steps = controller.play(index, designs)
    first = Tried(designs, returns, successes, origins, env_steps)
    parts = [first, *_generations(controller, index, own[0], budget, rng)]
    return Tried(
        np.concatenate([part.designs for part in parts]),
        np.concatenate([part.returns for part in parts]),
        np.concatenate([part.successes for part in parts]),
        [origin for part in parts for origin in part.origins],
        sum(part.env_steps for part in parts),
    )


def _generations(
    controller: Controller, index: int, start: Singles, budget: Budget, rng: np.random.Generator
) -> Iterator[Tried]:
    """Yield the generations of CMA-ES; where it has converged, it starts again at a random tool."""
    config = EvolutionConfig(popsize=budget.popsize, sigma0=budget.sigma0)
    centre: Floats = start.astype(np.float64)
    evolution = Evolution(len(centre), config, rng, centre)
    for _ in range(budget.candidates // budget.popsize):
        if evolution.converged:
            evolution = Evolution(len(centre), config, rng, rng.uniform(-1.0, 1.0, len(centre)))
        designs = evolution.ask().astype(UNIT)
        returns, successes, env_steps = controller.play(index, designs)
        evolution.tell(returns)
        yield Tried(designs, returns, successes, [SEARCH] * len(designs), env_steps)


def _measure(
    folder: Path, policy_name: str, tools: Singles, index: int, budget: Budget
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the row of one instance, and those of the tools that the policy judges, none if it does not judge any."""
    cell, controller = open_cell(folder), _controller(folder, policy_name)
    task, record = controller.problem.task, cell.record
    tried = measure_instance(controller, tools, index, budget)
    best = int(tried.returns.argmax())
    others = tried.origins.count(OTHER)
    returns, successes = tried.of(OTHER if others else DESIGNER)  # of a single instance there is no other
    own = {
        "task": record.task,
        "task_version": record.task_version,
        "method": record.method,
        "variant": record.variant.name,
        "seed": record.seed,
        "label": record.label or record.method,
        "policy": policy_name,
        "instance": index,
    }
    row = {
        **own,
        "designer_return": tried.returns[0],
        "designer_success": tried.successes[0],
        # As with reference points, return and success are the highest, each by itself.
        "best_return": tried.returns[best],
        "best_success": tried.successes.max(),
        "other_return": returns.max(),
        "other_success": successes.max(),
        "random_return": tried.of(RANDOM)[0].mean(),
        "random_success": tried.of(RANDOM)[1].mean(),
        "found_by": tried.origins[best],
        "env_steps": tried.env_steps,
        **asdict(budget),
        "other_tools": others,
    }
    named = (
        ("instance", task.instance_space.names, controller.instances[index]),
        ("design", task.design_space.names, task.design_space.from_unit(tried.designs[best])),
    )
    for kind, names, values in named:
        row |= {f"{kind}_{name}": float(value) for name, value in zip(names, values, strict=True)}
    return row, [{**own, **judged} for judged in judgements(controller, index, tried)]


def judgements(controller: Controller, index: int, tried: Tried) -> list[dict[str, Any]]:
    """Return rows of the designer's own tool and of the random ones: as the policy judges them, and as they played.

    Those of the search are left out: they crowd together where the returns are high, and would say little of whether
    the policy tells good designs from bad ones. Nothing is returned for a policy that does not judge designs.
    """
    chosen = [number for number, origin in enumerate(tried.origins) if origin in (DESIGNER, RANDOM)]
    (observation,) = controller.observations(np.array([index]))
    values = controller.policy.design_values(observation, tried.designs[chosen])
    if values is None:
        return []
    return [
        {
            "tool": tool,
            "origin": tried.origins[number],
            "value": float(value),
            "return": tried.returns[number],
            "success": tried.successes[number],
        }
        for tool, (number, value) in enumerate(zip(chosen, values, strict=True))
    ]


@lru_cache(maxsize=1)
def _controller(folder: Path, policy_name: str) -> Controller:
    """Return the controller of a cell, loaded once per process; `policy_name` tells a policy from a former one."""
    del policy_name
    cell = open_cell(folder)
    return Controller(policy_of(cell), problem_of(cell))


def _refuse_other(path: Path, rows: list[dict[str, Any]], wanted: dict[str, Any]) -> None:
    """Check that stored rows are of the same policy and budget.

    Raises:
        UserError: they are not; names the differences.
    """
    found = {
        f"{name}: stored {row[name]}, requested {value}"
        for row in rows
        for name, value in wanted.items()
        if row[name] != value
    }
    if found:
        raise UserError(f"{path} was measured otherwise ({'; '.join(sorted(found))}); choose another --results folder")
