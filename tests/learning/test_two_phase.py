"""The two-phase learner: who gets which credit, what is learned, when it stops, and that it goes on where it stood.

Value networks are set to a constant here, so that advantages follow from the rewards by a plain sum.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from codesign_bench.learning import two_phase
from codesign_bench.learning.ppo import PolicyUpdate, ValueUpdate
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.rollout import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.task import Floats, Task
from tolerances import of_sum

pytestmark = pytest.mark.numeric

MakeLearner = Callable[..., TwoPhaseLearner]
BUDGET = 10_000
CREDITS = pytest.mark.parametrize("credit", ["joint", "separate"])


class Recorder:
    """What the learner hands to its policy and value updates."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.advantages: list[Floats] = []
        self.rows: list[list[int]] = []
        self.value_steps: list[ValueUpdate] = []
        recorder = self

        class RecordedPolicyUpdate(PolicyUpdate):
            """Remembers its advantages and the rows it was stepped with."""

            def __init__(self, *arguments: Any) -> None:
                super().__init__(*arguments)
                recorder.advantages.append(self.advantage.numpy().copy())
                recorder.rows.append([])
                self.number = len(recorder.rows) - 1

            def step(self, rows: Any) -> None:
                """Remember the rows."""
                recorder.rows[self.number].extend(rows.tolist())
                super().step(rows)

        class RecordedValueUpdate(ValueUpdate):
            """Counts its steps."""

            def step(self, rows: Any) -> None:
                """Count the step."""
                recorder.value_steps.append(self)
                super().step(rows)

        monkeypatch.setattr(two_phase, "PolicyUpdate", RecordedPolicyUpdate)
        monkeypatch.setattr(two_phase, "ValueUpdate", RecordedValueUpdate)


@pytest.fixture
def recorder(monkeypatch: pytest.MonkeyPatch) -> Recorder:
    """Listen to the updates."""
    return Recorder(monkeypatch)


def make_constant(network: torch.nn.Module, value: float) -> None:
    """Let a perceptron value network put out `value`, whatever it sees."""
    layers: Any = network.mlp
    with torch.no_grad():
        layers[-1].weight.zero_()
        layers[-1].bias.fill_(value)


def normalized(values: Floats) -> Floats:
    """Return values with mean 0 and deviation 1."""
    return (values - values.mean()) / (values.std() + 1e-8)


def assert_normalized_alike(found: Floats, values: Floats) -> None:
    """Assert that numbers are those of `values` (n,), normalised, as far as fp32 allows."""
    expected = normalized(values)
    tolerance = of_sum(len(expected) + 4, np.abs(values).max() / values.std())
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def expected_advantages(batch: Trajectories, config: PPOConfig, value: float) -> Floats:
    """Return the (n,) advantages of the valid steps for a value network that always says `value`."""
    result: Floats = np.zeros(batch.valid.shape)
    for slot in range(len(result)):
        following = 0.0
        for step in range(int(batch.valid[slot].sum()) - 1, -1, -1):
            if batch.episode_end[slot, step]:
                following = 0.0
            nothing_follows = batch.terminated[slot, step]
            if not config.bootstrap_time_limit:
                nothing_follows |= batch.truncated[slot, step]
            later = 0.0 if nothing_follows else config.gamma * value
            error = batch.reward[slot, step] + later - value
            following = error + config.gamma * config.gae_lambda * following
            result[slot, step] = following
    return result[batch.valid]


@pytest.mark.parametrize("bootstrap", [True, False])
def test_joint_credit_treats_the_design_step_like_every_other(
    make_learner: MakeLearner, recorder: Recorder, bootstrap: bool
) -> None:
    learner = make_learner(design_credit="joint", bootstrap_time_limit=bootstrap, normalize_returns=False, epochs=1)
    make_constant(learner.value, 2.0)
    _, batch = learner.train(BUDGET)
    (advantage,), (rows,) = recorder.advantages, recorder.rows
    assert sorted(rows) == list(range(batch.env_steps)), "design and control steps share their minibatches"
    assert_normalized_alike(advantage, expected_advantages(batch, learner.config, 2.0))
    assert batch.truncated.any()
    assert batch.terminated.any()


def test_separate_credit_gives_the_design_step_its_undiscounted_return(
    make_learner: MakeLearner, recorder: Recorder
) -> None:
    learner = make_learner(design_credit="separate", gamma=0.5, epochs=1, design_epochs=1, normalize_returns=False)
    make_constant(learner.value, 2.0)
    make_constant(learner.design_value, 0.0)
    _, batch = learner.train(BUDGET)
    (control_advantage, design_advantage), (control_rows, design_rows) = recorder.advantages, recorder.rows
    is_design = batch.is_design[batch.valid]

    assert_normalized_alike(control_advantage[~is_design], expected_advantages(batch, learner.config, 2.0)[~is_design])
    assert not is_design[control_rows].any()
    assert len(control_rows) == (~is_design).sum()

    episodes = np.cumsum(is_design) - 1  # The episode that each valid step belongs to.
    returns = np.bincount(episodes, batch.reward[batch.valid])
    assert_normalized_alike(design_advantage, returns)
    assert sorted(design_rows) == list(range(len(returns)))


@CREDITS
def test_an_update_changes_every_network(make_learner: MakeLearner, credit: str) -> None:
    learner = make_learner(design_credit=credit)
    before = learner.state().arrays
    learner.train(BUDGET)
    after = learner.state().arrays
    same = [name for name in before if np.array_equal(before[name], after[name])]
    untouched = ["design_log_std", "control_log_std"] if credit == "separate" else ["log_std", "design_value"]
    assert [name for name in same if not any(part in name for part in untouched)] == []


@CREDITS
@pytest.mark.parametrize("fixed", [True, False])
def test_standard_deviations_are_learned_unless_fixed(make_learner: MakeLearner, credit: str, fixed: bool) -> None:
    learner = make_learner(design_credit=credit, fix_std=fixed, control_log_std=-0.5, design_log_std=-1.0)
    learner.train(BUDGET)
    for log_std, start in ((learner.actor.control_log_std, -0.5), (learner.actor.design_log_std, -1.0)):
        assert (log_std.detach() == start).all() == fixed


@CREDITS
def test_the_divergence_limit_stops_the_policy_but_not_the_value(
    make_learner: MakeLearner, recorder: Recorder, credit: str
) -> None:
    learner = make_learner(
        design_credit=credit, kl_threshold=1e-12, epochs=4, policy_learning_rate=0.1, minibatch_size=30
    )
    report, batch = learner.train(BUDGET)
    assert report.metrics["policy_steps"] < 4
    learned = batch.env_steps if credit == "joint" else int((batch.valid & ~batch.is_design).sum())
    assert sum(update.optimizer is learner.optimizers["value"] for update in recorder.value_steps) == 4 * round(
        learned / 30
    )


def test_designs_that_are_given_are_not_learned(make_learner: MakeLearner, recorder: Recorder) -> None:
    given = make_learner(fix_std=False)
    learner = TwoPhaseLearner(
        given.problem,
        given.config,
        given.streams,
        given.actor,
        given.value,
        lambda slots: np.zeros((len(slots), 1), np.float32),
    )
    head = {name: tensor.clone() for name, tensor in learner.actor.named_parameters() if "design" in name}
    _, batch = learner.train(BUDGET)
    for name, tensor in learner.actor.named_parameters():
        if "design" in name:
            assert torch.equal(tensor, head[name]), name
    assert not batch.is_design[batch.valid][recorder.rows[0]].any()


@CREDITS
def test_a_restored_learner_goes_on_bit_for_bit(make_learner: MakeLearner, credit: str) -> None:
    settings: dict[str, Any] = {"design_credit": credit, "fix_std": False, "final_learning_rate_fraction": 0.1}
    learner = make_learner(**settings)
    left = 500
    for _ in range(2):
        left -= learner.train(left)[0].env_steps
    state, streams = learner.state(), learner.streams.state()
    restored = make_learner(**settings)
    restored.load_state(state)
    restored.streams.load_state(streams)
    for _ in range(2):
        (report, _), (again, _) = learner.train(left), restored.train(left)
        assert report == again
        left -= report.env_steps
    first, second = learner.state(), restored.state()
    assert first.values == second.values
    assert first.arrays.keys() == second.arrays.keys()
    for name, array in first.arrays.items():
        np.testing.assert_array_equal(array, second.arrays[name], err_msg=name)


def test_step_sizes_fall_linearly_over_the_budget(make_learner: MakeLearner) -> None:
    learner, budget = make_learner(final_learning_rate_fraction=0.2, policy_learning_rate=1e-3), 300
    done = 0
    while done < budget:
        report, _ = learner.train(budget - done)
        expected = 1e-3 * (1.0 - 0.8 * done / budget)
        assert learner.optimizers["policy"].param_groups[0]["lr"] == pytest.approx(expected)
        done += report.env_steps


def test_the_last_batch_of_a_budget_is_small(make_learner: MakeLearner, reach: Task) -> None:
    assert make_learner().train(1)[0].env_steps <= reach.horizon + 1


def test_an_unknown_credit_is_refused(make_learner: MakeLearner) -> None:
    with pytest.raises(ValueError, match="'joint' or 'separate', not 'shared'"):
        make_learner(design_credit="shared")


def test_it_learns_to_touch_the_goal(make_learner: MakeLearner) -> None:
    rates = dict.fromkeys(("policy_learning_rate", "value_learning_rate", "design_learning_rate"), 3e-3)
    learner = make_learner(batch_size=600, minibatch_size=100, design_minibatch_size=100, **rates)
    success = [learner.train(BUDGET)[0].metrics["train_success"] for _ in range(12)]
    assert success[0] < 0.5 < 0.8 < np.mean(success[-3:])


def test_a_minibatch_without_a_design_step_is_learned_from(make_learner: MakeLearner) -> None:
    learner = make_learner(design_credit="joint", minibatch_size=2, epochs=1)  # One step in six is a design step.
    report, _ = learner.train(BUDGET)
    assert report.metrics["policy_steps"] > 1
    assert all(torch.isfinite(p).all() for p in learner.actor.parameters())
