"""All checks of a method, in the order in which they are asked."""

from __future__ import annotations

from collections.abc import Iterator

import codesign_bench.contract.method_declaration as method_declaration
import codesign_bench.contract.method_policy as method_policy
import codesign_bench.contract.method_resuming as method_resuming
import codesign_bench.contract.method_training as method_training
from codesign_bench.contract.check import Check, Verdict, ask, examine
from codesign_bench.contract.subject import Subject
from codesign_bench.method import load_method
from codesign_bench.task import Task

LOADS: Check[str] = method_declaration.loads
METHOD_CHECKS: tuple[Check[Subject], ...] = (
    method_declaration.hyperparameters_have_defaults,
    method_declaration.label_is_its_own,
    method_declaration.profiles_are_valid,
    method_training.training_changes_the_policy,
    method_training.every_step_counts,
    method_training.last_batch_is_small,
    method_training.seed_decides,
    method_training.global_generators_are_left_alone,
    method_policy.actions_are_in_bounds,
    method_policy.tools_are_per_goal_if_it_says_so,
    method_policy.tensors_are_all_of_a_policy,
    method_policy.tensors_are_copies,
    method_policy.policies_can_be_sent,
    method_policy.trained_policies_are_taken_over,
    method_resuming.resumes_to_the_bit,
)
"""What is promised of every method that can be loaded."""


def examine_method(name: str, task: Task) -> Iterator[Verdict]:
    """Yield the verdict of each check on the method of this name, examined on a task, as soon as it is known.

    Raises:
        UserError: there is no such method.
        UnavailableError: this Python lacks what it needs.
    """
    verdict = ask(LOADS, name)
    yield verdict
    if not verdict.faults:
        method_class = load_method(name)
        yield from examine(METHOD_CHECKS, Subject(method_class, task), method_class)
