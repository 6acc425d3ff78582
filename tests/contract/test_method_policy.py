"""Each check of a method's policy finds the fault that it is there for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from codesign_bench.contract import Check, Subject
from codesign_bench.contract import method_policy as checks
from codesign_bench.errors import UserError
from codesign_bench.method import Array, Method, Policy
from codesign_bench.task import Singles
from contract_faults import FaultsOf
from sound import SoundSearch
from toy import ConstantPolicy


def policy(kind: type[ConstantPolicy]) -> dict[str, Any]:
    """Return a change to policies of a kind."""
    return {
        "policy": lambda self: kind(self.best.copy()),
        "make_policy": classmethod(lambda cls, task, config, tensors: kind(tensors["vector"])),
    }


class Wild(ConstantPolicy):
    """Acts beyond the bounds."""

    def act(self, observation: Singles) -> Singles:
        return 3.0 + super().act(observation)


class Double(ConstantPolicy):
    """Acts in double precision."""

    def act(self, observation: Singles) -> Singles:
        return super().act(observation).astype(np.float64)  # type: ignore[return-value]


class Averaging(ConstantPolicy):
    """Designs by the mean of what it sees."""

    def design(self, observation: Singles) -> Singles:
        return np.tanh(super().design(observation) + observation[..., 1:2].mean())


class Stacked(ConstantPolicy):
    """Returns a row for one observation, too."""

    def design(self, observation: Singles) -> Singles:
        return np.atleast_2d(super().design(observation))


class PerGoal(ConstantPolicy):
    """Makes another tool for another goal."""

    def design(self, observation: Singles) -> Singles:
        return observation[..., 1:2]


class Forgetful(ConstantPolicy):
    """Keeps something that is not in its tensors."""

    def tensors(self) -> dict[str, Array]:
        return {"vector": np.round(self.vector, 1)}


class Closed(ConstantPolicy):
    """Holds what cannot be pickled."""

    def __init__(self, vector: Array) -> None:
        super().__init__(vector)
        self.squash = lambda values: np.tanh(values)


def shared(self: SoundSearch) -> Policy:
    """Return a policy on the arrays that training writes to."""
    return ConstantPolicy(self.best)


def in_place(self: SoundSearch, remaining_steps: int) -> Any:
    """Write to the arrays."""
    report = SoundSearch.train(self, remaining_steps)
    self.best = getattr(self, "place", self.best)
    self.best += 0.01
    self.place = self.best
    return report


def refusing(self: SoundSearch, tensors: dict[str, Array]) -> None:
    """Take over nothing."""
    raise UserError("not this one")


@pytest.mark.parametrize(
    ("check", "changes", "found"),
    [
        (checks.actions_are_in_bounds, policy(Wild), "a control from "),
        (checks.actions_are_in_bounds, policy(Double), "and type float64 for 6 observations"),
        (checks.actions_are_in_bounds, policy(Averaging), "a design differs by"),
        (checks.actions_are_in_bounds, policy(Stacked), "a design of shape (1, 1) for one observation"),
        (checks.tools_are_per_goal_if_it_says_so, policy(PerGoal), "6 different tools for 6 goals"),
        (checks.tools_are_per_goal_if_it_says_so, {"tool_per_goal": True}, "1 different tools for 6 goals"),
        (checks.tensors_are_all_of_a_policy, policy(Forgetful), "the policy from `tensors` gives another design"),
        (checks.tensors_are_copies, {"policy": shared, "train": in_place}, "changed by another batch: vector"),
        (checks.policies_can_be_sent, policy(Closed), "pickling it raised"),
        (checks.trained_policies_are_taken_over, {"start_from": lambda self, tensors: None}, "not taken over: vector"),
        (checks.trained_policies_are_taken_over, {"start_from": refusing}, "not this one"),
        (checks.trained_policies_are_taken_over, {"start_from": Method.start_from}, "it cannot start from"),
    ],
)
def test_what_is_wrong_is_found(
    method_faults: FaultsOf, check: Check[Subject], changes: dict[str, Any], found: str
) -> None:
    assert found in method_faults(check, **changes)
