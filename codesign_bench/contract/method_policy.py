"""Checks of a method's policy: what it acts like, and that its arrays are all there is to it.

Shapes: `B` batch, `O` observation, `D` design, `C` control.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import numpy as np

from codesign_bench.contract.check import DoesWithoutError, Fault, counted, promised
from codesign_bench.contract.subject import BUDGET, Subject, unlike
from codesign_bench.errors import UserError
from codesign_bench.method import Method, Policy

METHOD, POLICY = "codesign_bench.method.Method", "codesign_bench.method.Policy"
PATIENCE = 20
"""Batches within which a method has another tool for another goal."""
ROUNDING = 1e-3
"""Of actions in [-1, 1]: a library may add up one row and many in another order, and networks may be wide and deep."""


@promised("Actions are finite, inside of [-1, 1], and alike for one observation and for many.", POLICY)
def actions_are_in_bounds(subject: Subject) -> Iterator[Fault]:
    """Yield where they are not."""
    yield from unlike_alone(subject, subject.trained().policy(), ROUNDING)


def unlike_alone(subject: Subject, policy: Policy, tolerance: float) -> Iterator[Fault]:
    """Yield actions that are out of bounds, or differ by more than a tolerance when asked for one by one."""
    for phase, choose, seen, size in subject.phases(policy):
        batched = choose(seen)
        if batched.shape != (len(seen), size) or batched.dtype != np.float32:
            yield Fault(
                f"a {phase} of shape {batched.shape} and type {batched.dtype} for {len(seen)} observations",
                f"{(len(seen), size)} and float32",
            )
            continue
        if not np.isfinite(batched).all() or np.abs(batched).max() > 1.0:
            yield Fault(f"a {phase} from {batched.min():.4g} to {batched.max():.4g}", "finite values in [-1, 1]")
        for row, expected in zip(seen, batched, strict=True):
            alone = choose(row)
            if alone.shape != (size,):
                yield Fault(f"a {phase} of shape {alone.shape} for one observation ({len(row)},)", f"{(size,)}")
                break
            if (away := float(np.abs(alone - expected).max(initial=0.0))) > tolerance:
                yield Fault(f"a {phase} differs by {away:.2g} when asked for alone", "the same but for rounding")
                break


@promised("It designs a tool per goal where it says so, and one for all goals elsewhere.", f"{METHOD}.tool_per_goal")
def tools_are_per_goal_if_it_says_so(subject: Subject) -> Iterator[Fault]:
    """Yield what it does instead."""
    method = subject.make()
    # Some begin with one tool for all, and some search for a while before they choose.
    for _ in range(PATIENCE if method.tool_per_goal else 2):
        method.train(BUDGET)
        tools = np.unique(method.policy().design(subject.observations()[0]), axis=0)
        if len(tools) > 1:
            break
    if (len(tools) > 1) != method.tool_per_goal:
        yield Fault(
            f"{len(tools)} different tools for {len(subject.observations()[0])} goals, and `tool_per_goal` is "
            f"{method.tool_per_goal}",
            "tool_per_goal = False for a method that makes one tool for all goals, else several tools",
        )


@promised("A policy that is made from its tensors acts like the first.", f"{METHOD}.make_policy")
def tensors_are_all_of_a_policy(subject: Subject) -> Iterator[Fault]:
    """Yield where it does not."""
    method = subject.trained()
    policy = method.policy()
    copy = type(method).make_policy(subject.task, method.config, policy.tensors())
    yield from subject.acting_unlike(policy, copy, "the policy from `tensors`")
    if differing := unlike(policy.tensors(), copy.tensors()):
        yield Fault(f"its `tensors` are others: {counted(differing)}", "the arrays that it was made from")


@promised("Tensors that were asked for do not change when training goes on.", f"{POLICY}.tensors")
def tensors_are_copies(subject: Subject) -> Iterator[Fault]:
    """Yield those that do."""
    method = subject.trained()
    tensors = method.policy().tensors()
    kept = {name: tensor.copy() for name, tensor in tensors.items()}
    method.train(BUDGET)
    if differing := unlike(tensors, kept):
        yield Fault(f"changed by another batch: {counted(differing)}", "copies of arrays that training writes to")


@promised("A policy can be sent to another process, by pickle.", f"{METHOD}.policy")
def policies_can_be_sent(subject: Subject) -> Iterator[Fault]:
    """Yield why it cannot, or what it becomes on the way."""
    policy = subject.trained().policy()
    try:
        copy = pickle.loads(pickle.dumps(policy))  # bytes that were just made here; nothing is read
    except Exception as error:
        yield Fault(f"pickling it raised {type(error).__name__}: {error}", "no error: evaluation uses several cores")
        return
    yield from subject.acting_unlike(policy, copy, "the policy that arrives")


@promised("It takes over a trained policy, or says that it cannot.", f"{METHOD}.start_from")
def trained_policies_are_taken_over(subject: Subject) -> Iterator[Fault]:
    """Yield what is left of its own start."""
    donor, heir = subject.make(), subject.make(seed=1)
    tensors = donor.policy().tensors()
    if subject.method_class.start_from is Method.start_from:
        raise DoesWithoutError("it cannot start from a trained policy")
    try:
        heir.start_from(tensors)
    except UserError as error:
        raise DoesWithoutError(str(error)) from error
    if differing := unlike(heir.policy().tensors(), donor.policy().tensors()):
        yield Fault(f"not taken over: {counted(differing)}", "all arrays of the policy")
