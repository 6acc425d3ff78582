"""The fast update takes the same steps as one written plainly: a loop over samples' nodes and over minibatches.

The plain one knows none of the shortcuts: every layer computes every node, each link is its own product, policy and
value are updated in turn, gradients are clipped by hand, and Adam is written out. It is computed in double precision.

Every step is compared by itself: the plain one starts from the weights and moments that the fast one had. In single
precision a step is no smooth function of its numbers: a weight whose gradient is nearly zero moves by anything up to a
whole learning rate, and a ReLU whose input is nearly zero opens or stays shut, as rounding has it. So steps are
compared where rounding is too small for that: the fast update, the same code, runs in double precision. In single
precision its gradients are compared.

Shapes: `n` steps of a batch, `m` rows of a minibatch, `N` nodes, `F` features.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from codesign_bench.learning.actor import LOG_PROB
from codesign_bench.learning.ppo import PolicyUpdate, Update
from codesign_bench.learning.ppo_config import PPOConfig
from codesign_bench.learning.trajectories import Trajectories
from codesign_bench.learning.two_phase import TwoPhaseLearner
from codesign_bench.learning.update_loop import UpdateLoop
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import Slots, load_task
from double_precision import compute_in_double
from tolerances import DOUBLE, SINGLE, of_adam_step, of_sum

pytestmark = pytest.mark.numeric

SMALL = {
    "batch_size": 640,
    "minibatch_size": 200,
    "epochs": 3,
    "design_credit": "joint",
    "kl_threshold": 0.0142,  # So low that the policy's update is cut short, and would go on if it looked again.
    "max_gradient_norm": 0.3,  # So low that gradients are clipped.
    "policy_learning_rate": 1e-3,
    "value_learning_rate": 3e-3,
    "fix_std": False,  # Both standard deviations are learned, too,
    "entropy_weight": 0.1,  # and the entropy bonus says something of them.
}
Weights = dict[str, Tensor]


@dataclass
class Moments:
    """Adam's running means of gradients and of their squares, and the number of its steps, by weight."""

    first: Weights = field(default_factory=dict)
    second: Weights = field(default_factory=dict)
    count: dict[str, int] = field(default_factory=dict)


@dataclass
class Stand:
    """Where the fast update stood at some time, by weight, all in double precision."""

    weights: Weights
    moments: Moments
    gradients: Weights
    """Those of the last step, clipped; a weight that has none is missing."""


@dataclass
class Taken:
    """What one network's fast update was given, and where it stood at its start and after each of its steps."""

    names: dict[int, str]
    """The names of all parameters by their ids."""
    update: Any = None
    rows: list[Any] = field(default_factory=list)
    stands: list[Stand] = field(default_factory=list)

    def begin(self, update: Any) -> None:
        """Remember where `update` stands before its first step."""
        if self.update is None:
            self.update = update
            self.stands.append(self.stand())

    def end(self, rows: Slots) -> None:
        """Remember where the update stands after a step on `rows` (m,)."""
        self.rows.append(rows.copy())
        self.stands.append(self.stand())

    def stand(self) -> Stand:
        """Return copies of weights, moments and gradients."""
        parameters = {self.names[id(parameter)]: parameter for parameter in self.update.parameters}
        state = {name: self.update.optimizer.state[p] for name, p in parameters.items()}
        state = {name: values for name, values in state.items() if values}
        return Stand(
            {name: parameter.detach().double().clone() for name, parameter in parameters.items()},
            Moments(
                {name: values["exp_avg"].double().clone() for name, values in state.items()},
                {name: values["exp_avg_sq"].double().clone() for name, values in state.items()},
                {name: int(values["step"]) for name, values in state.items()},
            ),
            {name: p.grad.double().clone() for name, p in parameters.items() if p.grad is not None},
        )


class Watching(UpdateLoop):
    """Takes the steps of the policy's and of the value network's update and remembers them."""

    def __init__(self, policy: Taken, value: Taken) -> None:
        super().__init__()
        self.policy, self.value = policy, value

    def step(self, update: Update, rows: Slots) -> None:
        """Take a step and remember where the network stood before and after it."""
        taken = self.policy if isinstance(update, PolicyUpdate) else self.value
        taken.begin(update)
        super().step(update, rows)
        taken.end(rows)


@dataclass
class Played:
    """A learner after one fast update and all that the plain one needs to know of it."""

    learner: TwoPhaseLearner
    batch: Trajectories
    actor: Weights
    """Parameters and buffers before the update."""
    value: Weights
    policy_taken: Taken
    value_taken: Taken

    @property
    def config(self) -> PPOConfig:
        """The learner's settings."""
        return self.learner.config


def played(monkeypatch: pytest.MonkeyPatch, unit: float) -> Played:
    """Return a learner after a fast update in single precision, or in double; its batch is the same for both."""
    method: Any = load_method("gnn_ppo")
    config = replace(method.config_class(), **SMALL)
    learner: TwoPhaseLearner = method(Problem(load_task("push")), config, Streams(0)).learner
    see(learner, learner.collect(config.batch_size, 4))
    batch = learner.collect(config.batch_size, 4)
    modules = (learner.actor, learner.value)
    taken = [Taken({id(p): name for name, p in module.named_parameters()}) for module in modules]

    learner.loop = Watching(*taken)
    if unit == DOUBLE:
        compute_in_double(monkeypatch, learner)
    before = [doubled(module) for module in modules]
    learner.update(batch)
    return Played(learner, batch, *before, *taken)


def see(learner: TwoPhaseLearner, batch: Trajectories) -> None:
    """Take a batch into the statistics by which observations are normalised, so that some are clipped."""
    observation, is_design = (torch.from_numpy(x[batch.valid]) for x in (batch.observation, batch.is_design))
    learner.actor.update_statistics(observation, is_design)
    learner.value.update_statistics(observation)


def doubled(module: torch.nn.Module) -> Weights:
    """Return copies of a module's parameters and buffers in double precision."""
    return {name: value.detach().double().clone() for name, value in module.state_dict(keep_vars=True).items()}


# The plain update -----------------------------------------------------------------------------------------------------


def convolved(weights: Mapping[str, Tensor], prefix: str, edges: Any, nodes: list[Tensor]) -> list[Tensor]:
    """Return one graph convolution with ReLU of (m, F) features of every node, node by node."""
    result = []
    for i, features in enumerate(nodes):
        neighbours = torch.zeros_like(features)
        for a, b in edges:
            if i in (a, b):
                neighbours = neighbours + nodes[b if i == a else a]
        own = features @ weights[f"{prefix}.own.weight"].t()
        from_neighbours = neighbours @ weights[f"{prefix}.neighbours.weight"].t()
        result.append(torch.relu(own + from_neighbours + weights[f"{prefix}.neighbours.bias"]))
    return result


def graph_features(weights: Weights, prefix: str, graph: Any, shared: Tensor, own: Tensor | None) -> list[Tensor]:
    """Return the (m, F) features of every node after all convolutions of the graph network at `prefix`."""
    nodes = []
    for i in range(graph.num_nodes):
        features = shared @ weights[f"{prefix}.shared.weight"].t() + weights[f"{prefix}.shared.bias"]
        if own is not None:
            features = features + own[i] @ weights[f"{prefix}.own.weight"].t()
        nodes.append(features)
    layer = 0
    while f"{prefix}.layers.{layer}.own.weight" in weights:
        nodes = convolved(weights, f"{prefix}.layers.{layer}", graph.edges, nodes)
        layer += 1
    return nodes


def index_mlp(weights: Weights, prefix: str, node: int, x: Tensor) -> Tensor:
    """Return the index MLP's output for the node with this index."""
    layer = 0
    while f"{prefix}.weights.{layer}" in weights:
        if layer:
            x = torch.tanh(x)
        x = x @ weights[f"{prefix}.weights.{layer}"][node] + weights[f"{prefix}.biases.{layer}"][node, 0]
        layer += 1
    return x


def perceptron(weights: Weights, prefix: str, x: Tensor) -> Tensor:
    """Return the output of tanh layers and a linear one."""
    layers = sorted(int(key.split(".")[-2]) for key in weights if key.startswith(prefix) and key.endswith("weight"))
    for layer in layers:
        if layer:
            x = torch.tanh(x)
        x = x @ weights[f"{prefix}.{layer}.weight"].t() + weights[f"{prefix}.{layer}.bias"]
    return x


class Plain:
    """The losses of both networks as functions of their weights, on one batch, in double precision."""

    def __init__(self, fast: Played) -> None:
        batch, valid, task = fast.batch, fast.batch.valid, fast.learner.problem.task
        self.fast, self.graph = fast, task.tool_graph
        self.features: Any = fast.learner.actor.designer.features
        self.observation = torch.from_numpy(batch.observation[valid])
        self.is_design = torch.from_numpy(batch.is_design[valid])
        self.control, self.design = (torch.from_numpy(x[valid]).double() for x in (batch.control, batch.design))
        self.old_log_prob = torch.from_numpy(batch.extras[LOG_PROB][valid]).double()
        self.own = self.features.nodes(self.observation).double()

    def normed(self, weights: Weights, prefix: str, rows: Any) -> Tensor:
        """Return state and goal of the rows, normalised by a network's statistics and clipped."""
        values = self.features.task(self.observation)[rows].double()
        scaled = (values - weights[f"{prefix}.mean"]) / (weights[f"{prefix}.variance"] + 1e-8).sqrt()
        return scaled.clamp(-5.0, 5.0)

    def design_mean(self, actor: Weights, rows: Any) -> Tensor:
        """Return the mean designs (m, D)."""
        seen = self.normed(actor, "designer.norm", rows)
        nodes = graph_features(actor, "designer.graph", self.graph, seen, None)
        outputs = [index_mlp(actor, "designer.index_mlp", i, x) for i, x in enumerate(nodes)]
        places = [self.features.node_parameters[i].index(d) for d, i in enumerate(self.graph.parameter_nodes)]
        chosen = zip(self.graph.parameter_nodes, places, strict=True)
        return torch.stack([outputs[i][:, place] for i, place in chosen], dim=1)

    def control_mean(self, actor: Weights, rows: Any) -> Tensor:
        """Return the mean controls (m, C)."""
        seen = self.normed(actor, "controller.norm", rows)
        held = graph_features(actor, "controller.graph", self.graph, seen, self.own[:, rows])[0]
        return index_mlp(actor, "controller.index_mlp", 0, held)

    def policy_loss(self, actor: Weights, rows: Any) -> tuple[Tensor, float]:
        """Return the clipped loss with its entropy bonus and the divergence from the old policy."""
        log_probs, entropies = [], []
        for mean, key, action in (
            (self.design_mean(actor, rows), "design_log_std", self.design[rows]),
            (self.control_mean(actor, rows), "control_log_std", self.control[rows]),
        ):
            normal = torch.distributions.Normal(mean, actor[key].exp().expand_as(mean))
            log_probs.append(normal.log_prob(action).sum(dim=1))
            entropies.append(normal.entropy().sum(dim=1))
        # Without a design step among its rows, a minibatch says nothing of the designer, whose step is left out.
        is_design = self.is_design[rows]
        log_prob, entropy = (
            torch.where(is_design, *phases) if is_design.any() else phases[1] for phases in (log_probs, entropies)
        )
        ratio = (log_prob - self.old_log_prob[rows]).exp()
        advantage = self.fast.policy_taken.update.advantage[rows].double()
        low, high = 1.0 - self.fast.config.clip_ratio, 1.0 + self.fast.config.clip_ratio
        gained = torch.minimum(ratio * advantage, ratio.clamp(low, high) * advantage)
        loss = -(gained + self.fast.config.entropy_weight * entropy).mean()
        return loss, float((ratio - 1.0 - ratio.log()).mean().detach())

    def value_loss(self, value: Weights, rows: Any) -> tuple[Tensor, float]:
        """Return the mean squared error, and zero for a divergence that there is none of."""
        phase = self.features.phase(self.observation)[rows].double()
        shared = torch.cat([self.normed(value, "norm", rows), phase], dim=1)
        held = graph_features(value, "graph", self.graph, shared, self.own[:, rows])[0]
        target = self.fast.value_taken.update.target[rows].double()
        return ((perceptron(value, "mlp", held)[:, 0] - target) ** 2).mean(), 0.0

    def gradients(self, loss: Callable[..., Any], fixed: Weights, stand: Stand, rows: Any) -> tuple[Weights, float]:
        """Return the gradients of a loss at the weights of `stand`, clipped together, and the divergence."""
        learned = {name: value.clone().requires_grad_() for name, value in stand.weights.items()}
        value, divergence = loss(fixed | learned, rows)
        found = torch.autograd.grad(value, list(learned.values()), allow_unused=True)
        gradients = {name: g for name, g in zip(learned, found, strict=True) if g is not None}
        scale = min(1.0, self.fast.config.max_gradient_norm / (norm(gradients) + 1e-6))
        return {name: scale * gradient for name, gradient in gradients.items()}, divergence


def norm(weights: Weights) -> float:
    """Return the Euclidean norm of all numbers together."""
    return float(sum(float((value**2).sum()) for value in weights.values())) ** 0.5


def adam(stand: Stand, gradients: Weights, learning_rate: float, epsilon: float) -> Stand:
    """Return where Kingma and Ba's algorithm 1 gets to in one step."""
    weights, moments = dict(stand.weights), stand.moments
    first, second, count = dict(moments.first), dict(moments.second), dict(moments.count)
    for name, gradient in gradients.items():
        nothing = torch.zeros_like(gradient)
        count[name] = steps = count.get(name, 0) + 1
        first[name] = 0.9 * first.get(name, nothing) + 0.1 * gradient
        second[name] = 0.999 * second.get(name, nothing) + 0.001 * gradient**2
        mean, square = first[name] / (1.0 - 0.9**steps), second[name] / (1.0 - 0.999**steps)
        weights[name] = weights[name] - learning_rate * mean / (square.sqrt() + epsilon)
    return Stand(weights, Moments(first, second, count), gradients)


# The comparisons ------------------------------------------------------------------------------------------------------


def gradient_error(fast: Played, weights: Weights, unit: float) -> float:
    """Return how far two ways of computing a clipped gradient may lie apart.

    Forward and back, it is a chain of sums over layers' inputs and outputs, and over the rows at its end. The rows'
    gradients have all signs: their absolute values add up to about sqrt(m) times as much as they do.
    """
    rows = SMALL["minibatch_size"]
    terms = rows + 2 * sum(max(weight.shape) for weight in weights.values() if weight.dim() > 1)
    return of_sum(terms, rows**0.5 * fast.config.max_gradient_norm, unit)


def assert_close(found: Weights, expected: Weights, tolerance: float) -> None:
    """Assert that the same weights are there and no number is further from the expected one than `tolerance`."""
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=0, atol=tolerance, err_msg=name)


def learned(fast: Played, plain: Plain) -> list[tuple[str, Taken, Callable[..., tuple[Weights, float]]]]:
    """Return each network's key among the optimizers, its steps, and its plain gradients at a stand for some rows."""
    found = []
    for key, taken, fixed, loss in (
        ("policy", fast.policy_taken, fast.actor, plain.policy_loss),
        ("value", fast.value_taken, fast.value, plain.value_loss),
    ):
        found.append((key, taken, partial(plain.gradients, loss, fixed)))
    return found


def test_the_fast_update_takes_the_steps_of_a_plain_one(monkeypatch: pytest.MonkeyPatch) -> None:
    fast = played(monkeypatch, DOUBLE)
    config, steps = fast.config, {}
    for key, taken, gradients_at in learned(fast, Plain(fast)):
        defaults = fast.learner.optimizers[key].defaults
        rate, epsilon = getattr(config, f"{key}_learning_rate"), defaults["eps"]
        error = gradient_error(fast, taken.stands[0].weights, DOUBLE)
        stopped, steps[key] = False, 0
        for rows, before, after in zip(taken.rows, taken.stands[:-1], taken.stands[1:], strict=True):
            gradients, divergence = gradients_at(before, rows)
            stopped = stopped or divergence > config.kl_threshold
            steps[key] += not stopped
            expected = before if stopped else adam(before, gradients, rate, epsilon)
            assert_close(after.weights, expected.weights, 0.0 if stopped else of_adam_step(rate, epsilon, error))
            assert_close(after.moments.first, expected.moments.first, error)
            assert_close(after.moments.second, expected.moments.second, error * config.max_gradient_norm)
            assert after.moments.count == expected.moments.count
    updates = config.epochs * max(1, round(fast.batch.env_steps / config.minibatch_size))
    assert len(fast.policy_taken.rows) == len(fast.value_taken.rows) == steps["value"] == updates
    assert 1 < steps["policy"] == fast.policy_taken.update.steps < updates, "it is cut short on its way"


def test_in_single_precision_its_gradients_are_those_of_the_plain_one(monkeypatch: pytest.MonkeyPatch) -> None:
    fast = played(monkeypatch, SINGLE)
    for key, taken, gradients_at in learned(fast, Plain(fast)):
        apart = []
        steps = fast.policy_taken.update.steps if key == "policy" else len(taken.rows)
        for rows, before, after in zip(taken.rows[:steps], taken.stands, taken.stands[1:], strict=False):
            gradients, _ = gradients_at(before, rows)
            assert after.gradients.keys() == gradients.keys()
            apart.append(norm({name: after.gradients[name] - value for name, value in gradients.items()}))
        # A ReLU or a ratio on the wrong side of its kink changes one row's gradient, a share of 1/sqrt(m). It is rare:
        # a step has 100,000 inputs of ReLUs, of order one, and rounds them by some 1e-7.
        one_row = fast.config.max_gradient_norm / fast.config.minibatch_size**0.5
        assert max(apart) < one_row
        assert np.median(apart) < gradient_error(fast, taken.stands[0].weights, SINGLE)
