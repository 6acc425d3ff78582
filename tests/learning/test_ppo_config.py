"""Hyperparameters out of range are refused when a configuration is made, naming the culprit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from codesign_bench.config.resolve import resolve
from codesign_bench.errors import UserError
from codesign_bench.learning.cma_es import EvolutionConfig
from codesign_bench.learning.ppo_config import GraphConfig, PerceptronConfig, PPOConfig
from codesign_bench.method import load_method


@pytest.mark.parametrize(
    ("config", "change"),
    [
        (PPOConfig(), {"minibatch_size": 0}),
        (PPOConfig(), {"epochs": -1}),
        (PPOConfig(), {"gamma": 1.5}),
        (PPOConfig(), {"num_slots": 0}),
        (PPOConfig(), {"policy_learning_rate": -1e-3}),
        (PPOConfig(), {"gae_lambda": float("nan")}),
        (GraphConfig(), {"control_gnn": (64, 0)}),
        (GraphConfig(), {"design_gnn": ()}),
        (PerceptronConfig(), {"policy_net": (0,)}),
        (PerceptronConfig(), {"value_net": ()}),
        (EvolutionConfig(), {"popsize": 1}),
        (EvolutionConfig(), {"sigma0": 0.0}),
        (EvolutionConfig(), {"sigma0": float("inf")}),
        (PPOConfig(), {"control_log_std": float("nan")}),
        (PPOConfig(), {"batch_size": 10**15}),
    ],
)
def test_a_value_out_of_range_is_named(config: Any, change: dict[str, Any]) -> None:
    (name,) = change
    with pytest.raises(ValueError, match=name):
        replace(config, **change)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"design_credit": "shared"}, "design_credit must be one of joint, separate, not 'shared'"),
        ({"precision": "half"}, "precision must be one of fp32, bf16, not 'half'"),
    ],
)
def test_an_unknown_choice_is_named_with_those_there_are(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(PPOConfig(), **change)


@pytest.mark.parametrize(
    ("override", "choices"), [("design_credit=shared", "joint, separate"), ("precision=half", "fp32, bf16")]
)
def test_the_command_line_names_the_choices(override: str, choices: str) -> None:
    with pytest.raises(UserError, match=f"expected one of {choices}"):
        resolve(load_method("gnn_ppo"), "push", "quick", [override])


def test_values_at_the_limits_are_allowed() -> None:
    assert PPOConfig(gamma=1.0, epochs=1, num_slots=None).gamma == 1.0
    assert EvolutionConfig(popsize=2).popsize == 2
