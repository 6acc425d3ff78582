"""Baselines for the speed of our learners: stable-baselines3's PPO, and the graph network built the usual way.

Shapes: `B` environments, `O` observation, `A` action, `N` nodes of the tool graph, `F` features of a node.
"""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import numpy as np

from codesign_bench.benchmarks.workload import Speed, Workload, configured
from codesign_bench.machine import peak_megabytes
from codesign_bench.task import Task, load_task
from codesign_bench.task.envs import environment_id, register_environments
from codesign_bench.task.episodes import Episodes

USUAL_ROLLOUT_STEPS, USUAL_MINIBATCHES = 300, 3
"""The usual way is slow, so it is measured over few steps."""


def stable_baselines3_alone(work: Workload) -> Speed:
    """Measure stable-baselines3's PPO with its own vector environment, which steps one environment after another."""
    from stable_baselines3.common.env_util import make_vec_env

    register_environments()
    return _stable_baselines3(work, make_vec_env(environment_id(work.task), n_envs=work.environments, seed=0))


def stable_baselines3_batched(work: Workload) -> Speed:
    """Measure stable-baselines3's PPO with our batched environments behind its interface."""
    from codesign_bench.adapters import SB3VecEnv

    return _stable_baselines3(work, SB3VecEnv(work.task, work.environments))


def _stable_baselines3(work: Workload, environments: Any) -> Speed:
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import CallbackList

    steps = work.batch_size // work.environments
    model = PPO(
        "MlpPolicy",
        environments,
        n_steps=steps,
        batch_size=work.minibatch_size,
        n_epochs=work.epochs,
        policy_kwargs={"net_arch": list(configured("policy_net", work))},
        device="cpu",
        seed=0,
    )
    samples = steps * work.environments
    _, callback = model._setup_learn(samples * work.repeats, CallbackList([]))
    rollouts, updates = [], []
    for _ in range(work.repeats):
        started = time.perf_counter()
        model.collect_rollouts(environments, callback, model.rollout_buffer, n_rollout_steps=steps)
        collected = time.perf_counter()
        model.train()
        rollouts.append(samples / (collected - started))
        updates.append(samples * work.epochs / (time.perf_counter() - collected))
    return Speed(median(rollouts), median(updates), peak_megabytes())


def usual_way(work: Workload) -> Speed:
    """Measure graph networks with the widths of ours, built from torch-geometric's layers on edge lists.

    They act on one state per call; minibatches are lists of single graphs, joined for every update.
    """
    policy = _usual_net(work, load_task(work.task).control_space.size, "control_index_mlp")
    value = _usual_net(work, 1, "value_mlp")
    started = time.perf_counter()
    seen = _usual_rollout(load_task(work.task), policy, value)
    rollout = len(seen) / (time.perf_counter() - started)
    started = time.perf_counter()
    _usual_update(seen, (policy, value), work.minibatch_size)
    update = USUAL_MINIBATCHES * work.minibatch_size / (time.perf_counter() - started)
    how = f"over {USUAL_ROLLOUT_STEPS} steps and {USUAL_MINIBATCHES} minibatches, on one core, extrapolated"
    return Speed(rollout, update, peak_megabytes(), how=how)


def _usual_net(work: Workload, outputs: int, index_widths: str) -> Any:
    """Return a linear input layer, graph convolutions, then a separate MLP for every node.

    Args:
        work: names the task and the widths.
        outputs: size of the output.
        index_widths: the hyperparameter of `gnn_ppo` with the widths of the MLPs.
    """
    import torch
    from torch import nn
    from torch_geometric.nn import GraphConv

    task = load_task(work.task)
    width, nodes = task.layout.goal.stop + 2 + _node_width(task), task.tool_graph.num_nodes
    sizes: tuple[int, ...] = configured("control_gnn", work)
    last: tuple[int, ...] = configured(index_widths, work)

    def head() -> nn.Sequential:
        layers: list[nn.Module] = []
        for a, b in zip((sizes[-1], *last[:-1]), last, strict=True):
            layers += [nn.Linear(a, b), nn.Tanh()]
        return nn.Sequential(*layers, nn.Linear(last[-1], outputs))

    class Net(nn.Module):
        """Maps joined graphs to the output of their first node."""

        def __init__(self) -> None:
            super().__init__()
            self.first = nn.Linear(width, sizes[0])
            self.convolutions = nn.ModuleList(
                GraphConv(a, b) for a, b in zip((sizes[0], *sizes[:-1]), sizes, strict=True)
            )
            self.heads = nn.ModuleList(head() for _ in range(nodes))

        def forward(self, batch: Any) -> Any:
            x = self.first(batch.x)
            for convolution in self.convolutions:
                x = torch.relu(convolution(x, batch.edge_index))
            per_node = x.view(-1, nodes, x.shape[-1])
            return torch.stack([head(per_node[:, node]) for node, head in enumerate(self.heads)], dim=1)[:, 0]

    return Net()


def _usual_rollout(task: Task, policy: Any, value: Any) -> list[Any]:
    """Play one environment with random tools, a state per call; return the graphs of all states."""
    import torch
    from torch_geometric.data import Batch, Data

    pairs = task.tool_graph.edges + tuple((b, a) for a, b in task.tool_graph.edges)
    edges = torch.tensor(pairs, dtype=torch.long).t().reshape(2, -1)
    episodes, slot, rng = Episodes(task, 1), np.array([0]), np.random.default_rng(0)
    seen, over = [], True
    for _ in range(USUAL_ROLLOUT_STEPS):
        if over:
            episodes.begin(slot, task.sample_instances(rng, 1))
            episodes.design(slot, rng.uniform(-1.0, 1.0, size=(1, task.design_space.size)))
        state = Data(x=torch.from_numpy(_node_features(task, episodes.observation[0])), edge_index=edges)
        with torch.no_grad():
            batch = Batch.from_data_list([state])
            control, _ = policy(batch), value(batch)
        _, terminated, truncated = episodes.control(slot, control.numpy().astype(np.float64))
        over = bool(terminated[0] or truncated[0])
        seen.append(state)
    return seen


def _usual_update(seen: list[Any], nets: tuple[Any, ...], minibatch_size: int) -> None:
    """Take a gradient step of every net for each of a few minibatches of graphs."""
    import torch
    from torch_geometric.data import Batch

    optimizers = [torch.optim.Adam(net.parameters(), lr=1e-4) for net in nets]
    for part in np.random.default_rng(0).integers(len(seen), size=(USUAL_MINIBATCHES, minibatch_size)):
        batch = Batch.from_data_list([seen[row] for row in part])
        for net, optimizer in zip(nets, optimizers, strict=True):
            optimizer.zero_grad()
            net(batch).square().mean().backward()
            optimizer.step()


def _node_width(task: Task) -> int:
    owners = task.tool_graph.parameter_nodes
    return max(owners.count(node) for node in range(task.tool_graph.num_nodes))


def _node_features(task: Task, observation: np.ndarray) -> np.ndarray:
    """Return (N, F): state, goal and phase, the same for every node, then the node's own design parameters."""
    layout, width = task.layout, _node_width(task)
    shared = np.concatenate([observation[: layout.goal.stop], observation[layout.phase][:2]])
    rows = []
    for node in range(task.tool_graph.num_nodes):
        own = [
            observation[layout.design][d] for d, owner in enumerate(task.tool_graph.parameter_nodes) if owner == node
        ]
        rows.append(np.concatenate([shared, own, np.zeros(width - len(own))]))
    return np.array(rows, dtype=np.float32)
