"""Convert networks and optimizers to named arrays and back, for checkpoints and policy files."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor, nn

from codesign_bench.errors import ChangedTaskError
from codesign_bench.learning.networks import RunningNorm
from codesign_bench.method import Array

Modules = Mapping[str, nn.Module]
"""Networks with their names in checkpoints."""

Optimizers = Mapping[str, torch.optim.Optimizer]
"""Optimizers with their names in checkpoints."""


def learner_arrays(modules: Modules, optimizers: Optimizers) -> dict[str, Array]:
    """Return copies of the state of `modules` and `optimizers` as arrays by name."""
    arrays: dict[str, Array] = {}
    for name, module in modules.items():
        arrays |= prefixed(f"{name}.", module_arrays(module))
    for name, optimizer in optimizers.items():
        arrays |= prefixed(f"optimizer.{name}.", optimizer_arrays(optimizer))
    return arrays


def load_learner_arrays(modules: Modules, optimizers: Optimizers, arrays: Mapping[str, Array]) -> None:
    """Restore the arrays that `learner_arrays` returned.

    Raises:
        ChangedTaskError: a module normalises another number of observed entries.
        RuntimeError: names or shapes differ from the modules' otherwise.
    """
    for name, module in modules.items():
        load_module_arrays(module, below(f"{name}.", arrays))
    for name, optimizer in optimizers.items():
        load_optimizer_arrays(optimizer, below(f"optimizer.{name}.", arrays))


def module_arrays(module: nn.Module) -> dict[str, Array]:
    """Return copies of a module's parameters and buffers as arrays by name."""
    return {name: tensor.detach().numpy().copy() for name, tensor in module.state_dict().items()}


def load_module_arrays(module: nn.Module, arrays: Mapping[str, Array]) -> None:
    """Restore the arrays that `module_arrays` returned.

    Raises:
        ChangedTaskError: the module normalises another number of observed entries.
        RuntimeError: names or shapes differ from the module's otherwise.
    """
    for name, part in module.named_modules():
        stored = arrays.get(f"{name}.mean" if name else "mean")
        if isinstance(part, RunningNorm) and stored is not None and len(stored) != len(part.mean):
            raise ChangedTaskError(
                f"trained with another observation: {len(stored)} entries of state and goal, now {len(part.mean)}"
            )
    module.load_state_dict({name: torch.from_numpy(np.array(array)) for name, array in arrays.items()})


def optimizer_arrays(optimizer: torch.optim.Optimizer) -> dict[str, Array]:
    """Return copies of an optimizer's moments and counts by "<parameter's index>.<name>"."""
    return {
        f"{index}.{name}": value.numpy().copy()
        for index, values in optimizer.state_dict()["state"].items()
        for name, value in values.items()
    }


def load_optimizer_arrays(optimizer: torch.optim.Optimizer, arrays: Mapping[str, Array]) -> None:
    """Restore the arrays that `optimizer_arrays` returned; the learning rate is unchanged."""
    state: dict[int, dict[str, Tensor]] = {}
    for key, array in arrays.items():
        index, name = key.split(".")
        state.setdefault(int(index), {})[name] = torch.from_numpy(np.array(array))
    optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})


def prefixed(prefix: str, arrays: Mapping[str, Array]) -> dict[str, Array]:
    """Return arrays with a prefix before their names."""
    return {f"{prefix}{name}": array for name, array in arrays.items()}


def below(prefix: str, arrays: Mapping[str, Array]) -> dict[str, Array]:
    """Return the arrays whose names begin with a prefix, by their names without it."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
