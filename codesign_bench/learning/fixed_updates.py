"""A batch's policy and value updates in steps of fixed shape that never ask the device: a GPU can replay them.

Shapes: `n` valid steps of a batch, `N` rows of the buffers, `k` minibatches, `w` places of a minibatch, `m` rows of it,
`A` action.

The steps are those of `UpdateLoop` up to rounding. Three things differ in form. A minibatch is padded: each phase has a
fixed number of places, and those without a row have weight 0 in every mean. Which minibatch is next is a counter on the
device. And the policy's KL stop is a number there, too: once it is 0, Adam skips its steps, as after an overflow in
reduced precision; the processor reads it once an epoch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import torch
from torch import Tensor

from codesign_bench.learning.compute import Compute
from codesign_bench.learning.credit import DesignCredit, Steps
from codesign_bench.learning.cuda_graph import Replayed
from codesign_bench.learning.ppo import PolicyLoss, gaussian, gradient_step, trained
from codesign_bench.learning.value_networks import ValueNetwork
from codesign_bench.task import Slots

ROWS_BLOCK = 4_096
"""Buffers hold a multiple of so many rows: batches differ in length by the rest of an episode (ours)."""
BLOCK = 64
"""A phase has a multiple of so many places in a minibatch, and there is room for a multiple of so many (ours)."""
Kind: TypeAlias = tuple[bool, ...]
"""Which phases have rows in a minibatch."""


@dataclass(frozen=True)
class Batch:
    """What the updates of a batch learn from, (n, ...) each, on the device."""

    steps: Steps
    old_log_prob: Tensor
    advantage: Tensor
    target: Tensor


class Places:
    """Minibatches of one kind on the device, padded, and which of them is next."""

    def __init__(self, device: torch.device) -> None:
        self._device = device
        self.widths: tuple[int, ...] = ()
        """Places of each phase; w together."""
        self._index, self._weight = torch.zeros(0, 0), torch.zeros(0, 0)
        self._next = torch.zeros(1, dtype=torch.int64, device=device)

    def load(self, minibatches: Sequence[Sequence[Slots]]) -> bool:
        """Take the rows of each phase of every minibatch; return whether shapes, and so memory, had to change."""
        needed = tuple(max(len(rows) for rows in phase) for phase in zip(*minibatches, strict=True))
        known = self.widths or (0,) * len(needed)
        widths = tuple(max(_in_blocks(most), now) for most, now in zip(needed, known, strict=True))
        grows = widths != self.widths or len(minibatches) > len(self._index)
        if grows:
            self.widths = widths
            shape = (max(_in_blocks(len(minibatches)), len(self._index)), sum(widths))
            self._index = torch.zeros(shape, dtype=torch.int64, device=self._device)
            self._weight = torch.zeros(shape, device=self._device)
        index, weight = padded(minibatches, self.widths)
        self._index[: len(index)].copy_(torch.from_numpy(index))
        self._weight[: len(weight)].copy_(torch.from_numpy(weight))
        self._next.zero_()
        return grows

    def take(self) -> tuple[Tensor, Tensor]:
        """Return row indices (w,) and weights (w,) of the next minibatch."""
        index, weight = (table.index_select(0, self._next)[0] for table in (self._index, self._weight))
        self._next.add_(1)
        return index, weight

    def of_phases(self, values: Tensor) -> Sequence[Tensor]:
        """Split values (w,) into those of each phase."""
        return values.split(self.widths)


def _in_blocks(count: int) -> int:
    return -(-count // BLOCK) * BLOCK


def padded(minibatches: Sequence[Sequence[Slots]], widths: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return row indices and weights, (k, w) each: places without a row have index 0 and weight 0."""
    index = np.zeros((len(minibatches), sum(widths)), dtype=np.int64)
    weight = np.zeros(index.shape, dtype=np.float32)
    starts = np.cumsum([0, *widths[:-1]])
    for place, phases in enumerate(minibatches):
        for start, rows in zip(starts, phases, strict=True):
            index[place, start : start + len(rows)] = rows
            weight[place, start : start + len(rows)] = 1.0
    return index, weight


def weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    """Return the mean () of values (w,) with these weights (w,)."""
    return (values * weight).sum() / weight.sum()


class Buffers:
    """Memory that holds one batch after the other."""

    def __init__(self) -> None:
        self._held: Batch | None = None

    def hold(self, batch: Batch) -> tuple[Batch, bool]:
        """Copy a batch; return it with N >= n rows, and whether the memory is other than for the batch before."""
        rows = len(batch.advantage)
        moved = self._held is None or len(self._held.advantage) < rows
        if moved or self._held is None:
            room = -(-rows // ROWS_BLOCK) * ROWS_BLOCK
            self._held = _mapped(batch, lambda values: values.new_zeros((room, *values.shape[1:])))
        for place, values in zip(_tensors(self._held), _tensors(batch), strict=True):
            place[:rows].copy_(values)
        return replace(self._held, steps=replace(self._held.steps, designing=batch.steps.designing)), moved


class FixedValueUpdate:
    """Value updates, one batch after the other."""

    def __init__(
        self, network: ValueNetwork, optimizer: torch.optim.Optimizer, max_norm: float, compute: Compute
    ) -> None:
        self.network, self.optimizer, self.max_norm, self.compute = network, optimizer, max_norm, compute
        self.parameters = trained(optimizer)
        self.step = Replayed(self._step, compute.device)
        self._places = Places(compute.device)
        self._loss = torch.zeros((), device=compute.device)
        self._batch: Batch

    def run(self, batch: Batch, epochs: Sequence[Sequence[Slots]], moved: bool) -> dict[str, float]:
        """Learn from the minibatches of every epoch; return the loss on the last one. See `FixedPolicyUpdate.run`."""
        self._batch = batch
        minibatches = [[rows] for epoch in epochs for rows in epoch]
        if self._places.load(minibatches) or moved:
            self.step = Replayed(self._step, self.compute.device)
        for _ in minibatches:
            self.step()
        return {"value_loss": float(self._loss)}

    def _step(self) -> None:
        """Take one gradient step on the next minibatch."""
        index, weight = self._places.take()
        values = self.compute.predict(self.network, self._batch.steps.observation[index])
        loss = weighted_mean((values - self._batch.target[index]) ** 2, weight)
        gradient_step(loss, self.optimizer, self.parameters, self.max_norm)
        self._loss.copy_(loss.detach())


class FixedPolicyUpdate:
    """Policy updates, one batch after the other."""

    def __init__(
        self, credit: DesignCredit, optimizer: torch.optim.Optimizer, loss: PolicyLoss, compute: Compute
    ) -> None:
        self.credit, self.optimizer, self.loss, self.compute = credit, optimizer, loss, compute
        self.parameters = trained(optimizer)
        self._running, self._taken, self._divergence = (torch.zeros((), device=compute.device) for _ in range(3))
        self.steps: dict[Kind, Replayed] = {}
        """The step on a minibatch of each kind."""
        self._places: dict[Kind, Places] = {}
        self._batch: Batch

    def run(self, batch: Batch, epochs: Sequence[Sequence[Slots]], moved: bool) -> dict[str, float]:
        """Learn from the minibatches of every epoch; return divergence and number of steps.

        Args:
            batch: what to learn from.
            epochs: row indices (m,) of each minibatch.
            moved: whether the batch lies in other memory than the one before.
        """
        self._batch = batch
        order = self._load(epochs, moved)
        self._running.fill_(1.0)
        self._taken.zero_()
        self._divergence.zero_()
        for epoch in order:
            for kind in epoch:
                self.steps[kind]()
            if not float(self._running):
                break
        return {"kl": float(self._divergence), "policy_steps": float(self._taken)}

    def _load(self, epochs: Sequence[Sequence[Slots]], moved: bool) -> list[list[Kind]]:
        """Lay out all minibatches on the device; return the kind of each."""
        of_kind: dict[Kind, list[list[Slots]]] = {}
        order: list[list[Kind]] = []
        for epoch in epochs:
            order.append([])
            for rows in epoch:
                # A phase without rows is left out, not padded: its parameters then have no gradient, and Adam passes
                # over them. With a gradient of 0, their momentum would move them.
                phases = self._of_phases(rows)
                kind = tuple(len(part) > 0 for part in phases)
                of_kind.setdefault(kind, []).append([part for part in phases if len(part)])
                order[-1].append(kind)
        if moved:
            self.steps.clear()
        for kind, minibatches in of_kind.items():
            places = self._places.setdefault(kind, Places(self.compute.device))
            if places.load(minibatches) or kind not in self.steps:
                self.steps[kind] = Replayed(partial(self._step, kind, places), self.compute.device)
        return order

    def _of_phases(self, rows: Slots) -> list[Slots]:
        """Return the rows of each phase that the update trains, of the rows (m,) of a minibatch."""
        designing = self._batch.steps.designing[rows]
        return [rows[~designing], rows[designing]][: len(self.credit.phases(self._batch.steps))]

    def _step(self, kind: Kind, places: Places) -> None:
        """Take one gradient step on the next minibatch, unless the update has stopped."""
        index, weight = places.take()
        phases = [phase for phase, present in zip(self.credit.phases(self._batch.steps), kind, strict=True) if present]
        log_probs, entropy = [], weight.new_zeros(())
        for (phase, action), rows, share in zip(phases, places.of_phases(index), places.of_phases(weight), strict=True):
            distribution = self.compute.distribution(phase, self._batch.steps.observation[rows])
            log_prob, of_phase = gaussian(*distribution, action[rows])
            log_probs.append(log_prob)
            entropy = entropy + share.sum() / weight.sum() * of_phase
        old, advantage = self._batch.old_log_prob[index], self._batch.advantage[index]
        loss, divergence = self.loss(
            torch.cat(log_probs), old, advantage, entropy, lambda values: weighted_mean(values, weight)
        )
        self._divergence.copy_(torch.where(self._running > 0, divergence, self._divergence))
        self._running.mul_(~(divergence > self.loss.kl_threshold))
        self._taken.add_(self._running)
        # As torch's gradient scaler says that a step overflowed: a fused optimizer skips it, with moments and count.
        self.optimizer.found_inf = 1.0 - self._running  # type: ignore[attr-defined]  # torch's scaler sets it, too
        gradient_step(loss, self.optimizer, self.parameters, self.loss.max_gradient_norm)


class FixedUpdates:
    """The policy and value updates of a learner on its device."""

    def __init__(self, policy: FixedPolicyUpdate, value: FixedValueUpdate) -> None:
        self.policy, self.value = policy, value
        self._buffers = Buffers()
        self._rates = [torch.zeros((), device=update.compute.device) for update in (policy, value)]

    def run(self, batch: Batch, epochs: Sequence[Sequence[Slots]]) -> dict[str, float]:
        """Learn from the minibatches, rows (m,) each, of every epoch; return the logged values."""
        held, moved = self._buffers.hold(batch)
        policy_rate, value_rate = self._rates
        with _rate_in(policy_rate, self.policy.optimizer):
            metrics = self.policy.run(held, epochs, moved)
        with _rate_in(value_rate, self.value.optimizer):
            return metrics | self.value.run(held, epochs, moved)


@contextmanager
def _rate_in(rate: Tensor, optimizer: torch.optim.Optimizer) -> Iterator[None]:
    """Let an optimizer read its learning rate from memory: a graph would repeat the number of its capture."""
    (group,) = optimizer.param_groups
    before = {name: group[name] for name in ("lr", "capturable")}
    group.update(lr=rate.fill_(before["lr"]), capturable=rate.is_cuda)
    try:
        yield
    finally:
        group.update(before)


def _mapped(batch: Batch, change: Callable[[Tensor], Tensor]) -> Batch:
    """Return a batch with every tensor changed."""
    steps: dict[str, Any] = {name: change(values) for name, values in _named(batch.steps)}
    own: dict[str, Any] = {name: change(values) for name, values in _named(batch)}
    return replace(batch, steps=replace(batch.steps, **steps), **own)


def _tensors(batch: Batch) -> list[Tensor]:
    """Return every tensor of a batch, in a fixed order."""
    return [values for part in (batch.steps, batch) for _, values in _named(part)]


def _named(part: Batch | Steps) -> list[tuple[str, Tensor]]:
    entries: list[tuple[str, Any]] = [(entry.name, getattr(part, entry.name)) for entry in fields(part)]
    return [(name, values) for name, values in entries if isinstance(values, Tensor)]
