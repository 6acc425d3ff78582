"""The fast update takes the same steps as one written plainly: a loop over samples' nodes and over minibatches.

The plain one knows none of the shortcuts: every layer computes every node, each link is its own product, policy and
value are updated in turn, gradients are clipped by hand, and Adam is written out. It reads the fast one's weights,
batch and minibatches, in double precision.

Shapes: `n` steps of a batch, `m` rows of a minibatch, `N` nodes, `F` features.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from codesign_bench.learning import two_phase
from codesign_bench.learning.ppo import PolicyUpdate, ValueUpdate
from codesign_bench.method import Problem, load_method
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task

SMALL = {
    "batch_size": 640,
    "minibatch_size": 200,
    "epochs": 3,
    "design_credit": "joint",
    "kl_threshold": 0.02,  # So low that a batch's policy update is cut short, too.
    "max_gradient_norm": 0.3,  # So low that gradients are clipped.
    "policy_learning_rate": 3e-3,
    "value_learning_rate": 3e-3,
}
Weights = dict[str, Tensor]


class Recorded:
    """What the fast update was given, and the weights after each of its steps."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.policy: list[Any] = []
        self.value: list[Any] = []
        recorded = self

        class Policy(PolicyUpdate):
            def step(self, rows: Any) -> None:
                super().step(rows)
                recorded.policy.append((self, rows.copy(), [p.detach().double().clone() for p in self.parameters]))

        class Value(ValueUpdate):
            def step(self, rows: Any) -> None:
                super().step(rows)
                recorded.value.append((self, rows.copy(), [p.detach().double().clone() for p in self.parameters]))

        monkeypatch.setattr(two_phase, "PolicyUpdate", Policy)
        monkeypatch.setattr(two_phase, "ValueUpdate", Value)


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


class PlainAdam:
    """Kingma and Ba's algorithm 1, after clipping the norm of all gradients together."""

    def __init__(self, learning_rate: float, max_norm: float, epsilon: float) -> None:
        self.learning_rate, self.max_norm, self.epsilon = learning_rate, max_norm, epsilon
        self.first: Weights = {}
        self.second: Weights = {}
        self.count: dict[str, int] = {}

    def step(self, weights: Weights, loss: Tensor) -> None:
        """Change `weights` in place."""
        names = [name for name, value in weights.items() if value.requires_grad]
        found = torch.autograd.grad(loss, [weights[name] for name in names], allow_unused=True)
        gradients = {name: gradient for name, gradient in zip(names, found, strict=True) if gradient is not None}
        norm = float(sum(float((gradient**2).sum()) for gradient in gradients.values())) ** 0.5
        scale = min(1.0, self.max_norm / (norm + 1e-6))
        for name, gradient in gradients.items():
            clipped = scale * gradient
            self.count[name] = count = self.count.get(name, 0) + 1
            self.first[name] = 0.9 * self.first.get(name, torch.zeros_like(clipped)) + 0.1 * clipped
            self.second[name] = 0.999 * self.second.get(name, torch.zeros_like(clipped)) + 0.001 * clipped**2
            first, second = self.first[name] / (1.0 - 0.9**count), self.second[name] / (1.0 - 0.999**count)
            with torch.no_grad():
                weights[name] -= self.learning_rate * first / (second.sqrt() + self.epsilon)


def doubled(module: torch.nn.Module) -> Weights:
    """Return a module's parameters and buffers in double precision, parameters with gradients."""
    learned = {name for name, parameter in module.named_parameters() if parameter.requires_grad}
    return {
        name: value.detach().double().clone().requires_grad_(name in learned)
        for name, value in module.state_dict(keep_vars=True).items()
    }


def test_the_fast_update_takes_the_steps_of_a_plain_one(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded = Recorded(monkeypatch)
    method: Any = load_method("gnn_ppo")
    task = load_task("push")
    config = replace(method.config_class(), **SMALL)
    learner = method(Problem(task), config, Streams(0)).learner
    batch = learner.collect(config.batch_size, 4)
    actor, value = doubled(learner.actor), doubled(learner.value)
    features, graph = learner.actor.designer.features, task.tool_graph
    parameters = [dict(module.named_parameters()) for module in (learner.actor, learner.value)]
    learner._update(batch)
    assert 1 < recorded.policy[0][0].steps < len(recorded.policy), "the policy's update is cut short on its way"

    observation = torch.from_numpy(batch.observation[batch.valid])
    is_design = torch.from_numpy(batch.is_design[batch.valid])
    control, design = (torch.from_numpy(x[batch.valid]).double() for x in (batch.control, batch.design))
    own = features.nodes(observation).double()

    def policy_loss(update: PolicyUpdate, rows: Any) -> tuple[Tensor, float]:
        seen = {phase: actor_inputs(phase)[rows] for phase in ("designer", "controller")}
        designed = graph_features(actor, "designer.graph", graph, seen["designer"], None)
        outputs = [index_mlp(actor, "designer.index_mlp", i, x) for i, x in enumerate(designed)]
        places = [features.node_parameters[i].index(d) for d, i in enumerate(graph.parameter_nodes)]
        design_mean = torch.stack(
            [outputs[i][:, place] for i, place in zip(graph.parameter_nodes, places, strict=True)], dim=1
        )
        held = graph_features(actor, "controller.graph", graph, seen["controller"], own[:, rows])[0]
        control_mean = index_mlp(actor, "controller.index_mlp", 0, held)
        log_probs = []
        for mean, key, action in (
            (design_mean, "design_log_std", design[rows]),
            (control_mean, "control_log_std", control[rows]),
        ):
            normal = torch.distributions.Normal(mean, actor[key].exp().expand_as(mean))
            log_probs.append(normal.log_prob(action).sum(dim=1))
        # Without a design step among its rows, a minibatch says nothing of the designer, whose step is left out.
        log_prob = torch.where(is_design[rows], *log_probs) if is_design[rows].any() else log_probs[1]
        ratio = (log_prob - update.old_log_prob[rows].double()).exp()
        advantage = update.advantage[rows].double()
        low, high = 1.0 - config.clip_ratio, 1.0 + config.clip_ratio
        loss = -torch.minimum(ratio * advantage, ratio.clamp(low, high) * advantage).mean()
        return loss, float((ratio - 1.0 - ratio.log()).mean().detach())

    def actor_inputs(phase: str) -> Tensor:
        return normed(actor, f"{phase}.norm")

    def normed(weights: Weights, prefix: str) -> Tensor:
        values = features.task(observation).double()
        scaled = (values - weights[f"{prefix}.mean"]) / (weights[f"{prefix}.variance"] + 1e-8).sqrt()
        return scaled.clamp(-5.0, 5.0)

    def value_loss(update: ValueUpdate, rows: Any) -> Tensor:
        shared = torch.cat([normed(value, "norm"), features.phase(observation).double()], dim=1)[rows]
        held = graph_features(value, "graph", graph, shared, own[:, rows])[0]
        predicted = perceptron(value, "mlp", held)[:, 0]
        return ((predicted - update.target[rows].double()) ** 2).mean()

    policy_adam, value_adam = (
        PlainAdam(rate, config.max_gradient_norm, learner.optimizers[name].defaults["eps"])
        for name, rate in (("policy", config.policy_learning_rate), ("value", config.value_learning_rate))
    )

    def taken(steps: list[Any], weights: Weights, names: Callable[[Any], list[str]], take: Callable[..., None]) -> None:
        for update, rows, after in steps:
            take(update, rows)
            for name, fast in zip(names(update), after, strict=True):
                np.testing.assert_allclose(fast, weights[name].detach(), atol=2e-5, rtol=0, err_msg=name)

    def names_in(known: Mapping[str, Any]) -> Callable[[Any], list[str]]:
        by_id = {id(parameter): name for name, parameter in known.items()}
        return lambda update: [by_id[id(parameter)] for parameter in update.parameters]

    stopped = False

    def take_policy_step(update: PolicyUpdate, rows: Any) -> None:
        nonlocal stopped
        loss, divergence = policy_loss(update, rows)
        stopped = stopped or divergence > config.kl_threshold
        if not stopped:
            policy_adam.step(actor, loss)

    taken(recorded.policy, actor, names_in(parameters[0]), take_policy_step)
    assert stopped
    taken(
        recorded.value,
        value,
        names_in(parameters[1]),
        lambda update, rows: value_adam.step(value, value_loss(update, rows)),
    )
    assert len(recorded.value) == config.epochs * max(1, round(batch.env_steps / config.minibatch_size))
