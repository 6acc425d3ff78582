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
    import torch
    from torch import nn
    from torch_geometric.data import Batch, Data
    from torch_geometric.nn import GraphConv

    task = load_task(work.task)
    convolution_widths: tuple[int, ...] = configured("control_gnn", work)
    layout, nodes = task.layout, task.tool_graph.num_nodes
    width = layout.goal.stop + 2 + _node_width(task)

    class Net(nn.Module):
        """A linear input layer, graph convolutions, then a separate MLP for every node."""

        def __init__(self, outputs: int, index_widths: tuple[int, ...]) -> None:
            super().__init__()
            sizes = convolution_widths
            self.first = nn.Linear(width, sizes[0])
            self.convolutions = nn.ModuleList(
                GraphConv(a, b) for a, b in zip((sizes[0], *sizes[:-1]), sizes, strict=True)
            )
            self.heads = nn.ModuleList()
            for _ in range(nodes):
                layers: list[nn.Module] = []
                for a, b in zip((sizes[-1], *index_widths[:-1]), index_widths, strict=True):
                    layers += [nn.Linear(a, b), nn.Tanh()]
                self.heads.append(nn.Sequential(*layers, nn.Linear(index_widths[-1], outputs)))

        def forward(self, batch: Any) -> Any:
            x = self.first(batch.x)
            for convolution in self.convolutions:
                x = torch.relu(convolution(x, batch.edge_index))
            per_node = x.view(-1, nodes, x.shape[-1])
            return torch.stack([head(per_node[:, node]) for node, head in enumerate(self.heads)], dim=1)[:, 0]

    policy = Net(task.control_space.size, configured("control_index_mlp", work))
    value = Net(1, configured("value_mlp", work))
    optimizers = [torch.optim.Adam(net.parameters(), lr=1e-4) for net in (policy, value)]
    pairs = task.tool_graph.edges + tuple((b, a) for a, b in task.tool_graph.edges)
    edges = torch.tensor(pairs, dtype=torch.long).t().reshape(2, -1)

    def graph(observation: np.ndarray) -> Any:
        return Data(x=torch.from_numpy(_node_features(task, observation)), edge_index=edges)

    episodes, slot, rng = Episodes(task, 1), np.array([0]), np.random.default_rng(0)
    seen, over = [], True
    started = time.perf_counter()
    for _ in range(USUAL_ROLLOUT_STEPS):
        if over:
            episodes.begin(slot, task.sample_instances(rng, 1))
            episodes.design(slot, rng.uniform(-1.0, 1.0, size=(1, task.design_space.size)))
        state = graph(episodes.observation[0])
        with torch.no_grad():
            batch = Batch.from_data_list([state])
            control, _ = policy(batch), value(batch)
        _, terminated, truncated = episodes.control(slot, control.numpy().astype(np.float64))
        over = bool(terminated[0] or truncated[0])
        seen.append(state)
    rollout = USUAL_ROLLOUT_STEPS / (time.perf_counter() - started)
    rows = rng.integers(len(seen), size=(USUAL_MINIBATCHES, work.minibatch_size))
    started = time.perf_counter()
    for part in rows:
        batch = Batch.from_data_list([seen[row] for row in part])
        for net, optimizer in zip((policy, value), optimizers, strict=True):
            optimizer.zero_grad()
            net(batch).square().mean().backward()
            optimizer.step()
    update = USUAL_MINIBATCHES * work.minibatch_size / (time.perf_counter() - started)
    how = f"over {USUAL_ROLLOUT_STEPS} steps and {USUAL_MINIBATCHES} minibatches, on one core, extrapolated"
    return Speed(rollout, update, peak_megabytes(), how=how)


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
