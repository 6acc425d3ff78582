"""Checks of how a method trains: that it learns, counts what it simulates, and draws from its own streams alone."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np
import torch

from codesign_bench.contract.check import Fault, promised
from codesign_bench.contract.subject import BUDGET, CountingTask, Subject, differing_state, unlike

METHOD = "codesign_bench.method.Method"
PATIENCE = 20
"""Batches within which something must have changed: some methods change only when they found something better."""


@promised("Training changes the policy, and what it reports is finite.", f"{METHOD}.train", first=True)
def training_changes_the_policy(subject: Subject) -> Iterator[Fault]:
    """Yield where it does not."""
    method = subject.make()
    before = method.policy().tensors()
    for _ in range(PATIENCE):
        report = method.train(BUDGET)
        after = method.policy().tensors()
        if before.keys() != after.keys():
            yield Fault(f"`tensors` has the names {sorted(before)}, later {sorted(after)}", "always the same names")
            return
        if unlike(before, after):
            break
    else:
        yield Fault(
            f"{PATIENCE} batches left every array of `policy().tensors()` as it was", "that training changes one"
        )
    if not report.metrics:
        yield Fault("`metrics` of a batch is empty", "at least one value about the method itself")
    if bad := [name for name, value in report.metrics.items() if not np.isfinite(value)]:
        yield Fault(f"not finite: {', '.join(bad)}", "finite metrics")


@promised("Reported steps are the simulated ones, those of candidates included.", "codesign_bench.method.BatchReport")
def every_step_counts(subject: Subject) -> Iterator[Fault]:
    """Yield batches that report other steps than they took."""
    counting = CountingTask(subject.task)
    method = subject.make(task=counting.task)
    for batch in range(2):
        before = counting.env_steps
        reported, simulated = method.train(BUDGET).env_steps, counting.env_steps - before
        if reported < 1 or reported != simulated:
            yield Fault(
                f"batch {batch} reports {reported} environment steps, and {simulated} were simulated",
                "both the same and positive; a design step is one, too",
            )


@promised("The last batch of a small budget is small.", f"{METHOD}.train")
def last_batch_is_small(subject: Subject) -> Iterator[Fault]:
    """Yield how much longer it is."""
    method = subject.make()
    steps = method.train(1).env_steps
    if not 1 <= steps <= method.shortest_batch:
        yield Fault(
            f"with one step left, a batch took {steps} steps",
            f"from 1 to {method.shortest_batch}, `shortest_batch`: train(remaining_steps) takes about that many",
        )


@promised("The seed decides all numbers.", "codesign_bench.seeding.Streams")
def seed_decides(subject: Subject) -> Iterator[Fault]:
    """Yield what the same seed changes, or another does not."""
    first, again, other = subject.make(), subject.make(), subject.make(seed=1)
    for batch in range(2):
        reports = first.train(BUDGET), again.train(BUDGET)
        if reports[0] != reports[1]:
            yield Fault(f"the same seed reports something else of batch {batch}", "equal reports")
        other.train(BUDGET)
    if differing := differing_state(first, again):
        yield Fault(f"the same seed gives another state: {', '.join(differing[:3])}", "equal states")
    for _ in range(PATIENCE):
        if unlike(first.policy().tensors(), other.policy().tensors()):
            break
        first.train(BUDGET), other.train(BUDGET)
    else:
        yield Fault("another seed gives the same policy", 'randomness from `self.streams["..."]`')


@promised("It touches no global generator.", "codesign_bench.seeding.Streams")
def global_generators_are_left_alone(subject: Subject) -> Iterator[Fault]:
    """Yield the generators that were drawn from or seeded."""
    before = _global_states()
    method = subject.trained()
    type(method).make_policy(method.problem.task, method.config, method.policy().tensors())
    for name, state in _global_states().items():
        if state != before[name]:
            yield Fault(f"the global generator of {name} was drawn from or seeded", 'draws from `self.streams["..."]`')


def _global_states() -> dict[str, bytes]:
    _, keys, *place = np.random.get_state(legacy=True)  # noqa: NPY002  # The point: nobody draws from it.
    return {
        "numpy": np.asarray(keys).tobytes() + repr(place).encode(),
        "torch": torch.get_rng_state().numpy().tobytes(),
        "random": repr(random.getstate()).encode(),
    }
