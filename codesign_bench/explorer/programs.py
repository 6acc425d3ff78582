"""A designer's network as a list of plain operations that any language can run.

The operations that torch executes for one observation are recorded, whatever modules they come from. What does not
depend on the observation is computed once; what only moves numbers (views, transposes, indexing, broadcasting) becomes
one list of positions. What remains has few kinds, each on flat arrays:

| operation | value |
| --- | --- |
| ("constant", k) | constant k |
| ("take", a, positions) | a[positions] |
| ("join", a, ...) | the arrays one behind the other |
| ("product", a, b, batch, m, k, n) | products of matrices, a (batch, m, k) and b (batch, k, n) |
| ("add" or "subtract" or "multiply" or "divide", a, b) | elementwise |
| ("relu" or "sigmoid" or "tanh" or "exp", a) | elementwise |
| ("clamp", a, low, high) | elementwise |

Operands are numbers of earlier operations; number 0 is the observation.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor, fx
from torch.fx.experimental.proxy_tensor import make_fx

from codesign_bench.task import Floats

Operation = tuple[Any, ...]
Act = Callable[[Tensor], Tensor]
"""Maps observations (B, O) to designs (B, D)."""

MOVES = frozenset(
    {
        *("alias", "cat", "clone", "contiguous", "detach", "expand"),
        *("flip", "index", "index_select", "narrow", "permute", "reshape"),
        *("select", "slice", "squeeze", "stack", "t", "transpose"),
        *("unsqueeze", "view", "_to_copy", "_unsafe_view", "unbind", "split"),
    }
)
"""Operations of torch whose every number is one of the operands' numbers."""
PAIRS = {"add": "add", "sub": "subtract", "mul": "multiply", "div": "divide"}
SINGLES = ("relu", "sigmoid", "tanh", "exp")
OPERANDS = {"constant": 0, "take": 1, "product": 2, "clamp": 1}
"""Operation -> how many of its entries are numbers of operations; of others, all are."""
LONG = 512
"""Constants of at least so many numbers are weights, which may be rounded; shorter ones keep single precision."""
LONGEST = 2**20
"""Most numbers of a value, or positions of an operation."""


class UnknownOperation(Exception):
    """A network has an operation that is not among the plain ones."""


@dataclass
class Program:
    """Operations on an observation (O,), whose last value is the design (D,)."""

    operations: list[Operation] = field(default_factory=lambda: [("observation",)])
    constants: list[np.ndarray] = field(default_factory=list)
    """Flat arrays."""

    def __call__(self, observation: Floats) -> Floats:
        """Return the design for an observation, in double precision."""
        values: list[Floats] = [np.asarray(observation, dtype=np.float64)]
        for name, *operands in self.operations[1:]:
            values.append(self._run(name, operands, values))
        return values[-1]

    def _run(self, name: str, operands: list[Any], values: list[Floats]) -> Floats:
        if name == "constant":
            return self.constants[operands[0]].astype(np.float64)
        if name == "take":
            return values[operands[0]][np.asarray(operands[1])]
        if name == "join":
            return np.concatenate([values[operand] for operand in operands])
        if name == "product":
            left, right, batch, rows, inner, columns = operands
            product = values[left].reshape(batch, rows, inner) @ values[right].reshape(batch, inner, columns)
            return product.ravel()
        if name == "clamp":
            return np.clip(values[operands[0]], operands[1], operands[2])
        functions: dict[str, Callable[..., Floats]] = {
            "relu": lambda x: np.maximum(x, 0.0),
            "sigmoid": lambda x: 1.0 / (1.0 + np.exp(-x)),
            "tanh": np.tanh,
            "exp": np.exp,
            **{pair: getattr(np, pair) for pair in PAIRS.values()},
        }
        return functions[name](*(values[operand] for operand in operands))

    @property
    def reads(self) -> bool:
        """Whether the design depends on the observation."""
        return any(0 in operands[: OPERANDS.get(name, len(operands))] for name, *operands in self.operations[1:])

    def rounded(self, bits: int) -> Program:
        """Return the program with every long constant rounded to `bits`, and the others to single precision."""
        return replace(
            self,
            constants=[
                rounded(constant, bits)[1] if constant.size >= LONG else constant.astype(np.float32).astype(np.float64)
                for constant in self.constants
            ],
        )


def rounded(values: np.ndarray, bits: int) -> tuple[float, np.ndarray]:
    """Return a step, and `values` rounded to multiples of it, of which there are 2^`bits`."""
    largest = float(np.abs(values).max(initial=0.0))
    step = largest / (2 ** (bits - 1) - 1) if largest else 1.0
    return step, np.rint(np.asarray(values, dtype=np.float64) / step) * step


def program_of(act: Act, size: int) -> Program:
    """Return the operations of `act` on an observation of `size` entries.

    Raises:
        UnknownOperation: one of them is not among the plain ones.
    """
    with torch.no_grad():
        graph = make_fx(act)(torch.zeros(1, size))
        return _Lowering(graph).run()


@dataclass
class _Value:
    """A tensor of the graph: its number, or the tensor itself if it does not depend on the observation."""

    shape: tuple[int, ...]
    number: int = -1
    tensor: Tensor | None = None


class _Lowering:
    """Turns a graph of torch's operations into a program."""

    def __init__(self, graph: fx.GraphModule) -> None:
        self.graph = graph
        self.program = Program()
        self.known: dict[bytes, int] = {}
        """Content of a constant -> number of its operation."""
        self.sizes: dict[int, int] = {0: -1}
        """Number of an operation -> how many numbers its value has; -1: not known."""

    def run(self) -> Program:
        """Return the program."""
        values: dict[str, Any] = {}
        for node in self.graph.graph.nodes:
            if node.op == "placeholder":
                values[node.name] = _Value(tuple(node.meta["val"].shape), number=0)
            elif node.op == "get_attr":
                tensor = operator.attrgetter(node.target)(self.graph).detach().clone()  # may be changed in place
                values[node.name] = _Value(tuple(tensor.shape), tensor=tensor)
            elif node.op == "output":
                result: Any = fx.map_arg(node.args[0], lambda other: values[other.name])
                result = result[0] if isinstance(result, (tuple, list)) else result
                self._take(self._number(result), np.arange(int(np.prod(result.shape))), always=True)
            else:
                values[node.name] = self._call(node, values)
        return self.program

    def _call(self, node: fx.Node, values: dict[str, Any]) -> Any:
        arguments: Any = fx.map_arg(node.args, lambda other: values[other.name])
        keywords: Any = fx.map_arg(node.kwargs, lambda other: values[other.name])
        inputs = [value for value in _flat((arguments, keywords)) if isinstance(value, _Value)]
        if node.target is operator.getitem:
            return arguments[0][arguments[1]]
        if all(value.number < 0 for value in inputs):
            result = node.target(*_tensors(arguments), **_tensors(keywords))  # type: ignore[operator]
            return _wrapped(result)
        name = node.target._schema.name.split("::")[1]  # type: ignore[union-attr]
        name = name.rstrip("_") if name.rstrip("_") else name
        if name in MOVES:
            return self._move(node.target, inputs, arguments, keywords)
        shape = tuple(node.meta["val"].shape)
        return self._compute(name, shape, arguments, keywords)

    def _compute(self, name: str, shape: tuple[int, ...], arguments: Any, keywords: dict[str, Any]) -> _Value:
        if name in PAIRS and not set(keywords) - {"alpha"} and keywords.get("alpha", 1) == 1:
            return self._pair(PAIRS[name], shape, *arguments[:2])
        if name in SINGLES and len(arguments) == 1:
            return self._append(shape, name, self._number(arguments[0]))
        if name in ("clamp", "hardtanh", "clamp_min", "clamp_max"):
            low, high = {"clamp_min": (arguments[1], None), "clamp_max": (None, arguments[1])}.get(
                name, (*arguments[1:3], None, None)[:2]
            )
            low, high = (keywords.get("min", low), keywords.get("max", high))
            bounds = (-1e300 if low is None else float(low), 1e300 if high is None else float(high))
            return self._append(shape, "clamp", self._number(arguments[0]), *bounds)
        if name in ("mm", "bmm", "matmul"):
            return self._product(arguments[0], arguments[1])
        if name in ("addmm", "baddbmm") and keywords.get("alpha", 1) == keywords.get("beta", 1) == 1:
            return self._pair("add", shape, self._product(arguments[1], arguments[2]), arguments[0])
        if name == "addcmul" and keywords.get("value", 1) == 1:
            factor = np.broadcast_shapes(arguments[1].shape, arguments[2].shape)
            return self._pair("add", shape, self._pair("multiply", factor, arguments[1], arguments[2]), arguments[0])
        if name == "neg":
            return self._pair("multiply", shape, arguments[0], -1.0)
        raise UnknownOperation(name)

    def _pair(self, name: str, shape: tuple[int, ...], left: Any, right: Any) -> _Value:
        numbers = [self._number(self._expanded(value, shape)) for value in (left, right)]
        return self._append(shape, name, *numbers)

    def _expanded(self, value: Any, shape: tuple[int, ...]) -> _Value:
        """Return a tensor or a number in the given shape."""
        if not isinstance(value, _Value):
            return _Value(shape, tensor=torch.full(shape, float(value), dtype=torch.float64))
        if value.shape == tuple(shape):
            return value
        if value.tensor is not None:
            return _Value(shape, tensor=value.tensor.expand(shape))
        positions = np.broadcast_to(np.arange(int(np.prod(value.shape))).reshape(value.shape), shape)
        return _Value(tuple(shape), self._take(value.number, positions.ravel()))

    def _product(self, left: _Value, right: _Value) -> _Value:
        if len(left.shape) != len(right.shape) or len(left.shape) not in (2, 3):
            raise UnknownOperation("a product of other than two matrices, or two batches of them")
        *batch, rows, inner = left.shape
        columns, count = right.shape[-1], int(np.prod(batch))
        numbers = (self._number(left), self._number(right))
        return self._append((*batch, rows, columns), "product", *numbers, count, rows, inner, columns)

    def _move(self, target: Any, inputs: list[_Value], arguments: Any, keywords: dict[str, Any]) -> Any:
        """Run an operation that only moves numbers on their positions in the operands, one behind the other."""
        sizes = [int(np.prod(value.shape)) for value in inputs]
        starts = np.cumsum([0, *sizes])
        if starts[-1] > LONGEST:
            raise UnknownOperation("a move of too many numbers")
        indices = {id(value): value for value in inputs if value.number < 0 and not value.tensor.is_floating_point()}  # type: ignore[union-attr]
        moved = [value for value in inputs if id(value) not in indices]
        places = {
            id(value): torch.arange(int(start), int(start) + size).view(value.shape)
            for value, start, size in zip(inputs, starts, sizes, strict=False)
        }
        places |= {key: value.tensor for key, value in indices.items()}  # type: ignore[misc]
        keywords = {key: value for key, value in keywords.items() if key != "dtype"}
        result = target(*_replaced(arguments, places), **_replaced(keywords, places))
        whole = self._join(moved, inputs)
        if isinstance(result, (tuple, list)):
            return [_Value(tuple(part.shape), self._take(whole, part.numpy().ravel())) for part in result]
        return _Value(tuple(result.shape), self._take(whole, result.numpy().ravel()))

    def _join(self, moved: list[_Value], inputs: list[_Value]) -> int:
        """Return the number of the moved values, one behind the other."""
        if len(moved) == 1 and inputs[0] is moved[0]:
            return self._number(moved[0])
        if len(moved) != len(inputs):
            raise UnknownOperation("an index before what it is an index of")
        return self._append((), "join", *(self._number(value) for value in inputs)).number

    def _take(self, number: int, positions: np.ndarray, always: bool = False) -> int:
        if not always and self.sizes[number] == len(positions) and (positions == np.arange(len(positions))).all():
            return number
        return self._append((len(positions),), "take", number, positions.tolist()).number

    def _number(self, value: _Value) -> int:
        """Return the number of a value's operation; a constant gets one on its first use."""
        if value.number >= 0:
            return value.number
        assert value.tensor is not None
        flat = value.tensor.detach().reshape(-1).to(torch.float64).numpy()
        key = flat.tobytes()
        if key not in self.known:
            self.program.constants.append(flat)
            self.known[key] = self._append(value.shape, "constant", len(self.program.constants) - 1).number
        return self.known[key]

    def _append(self, shape: tuple[int, ...], name: str, *operands: Any) -> _Value:
        if int(np.prod(shape)) > LONGEST:
            raise UnknownOperation("a value of too many numbers")
        self.program.operations.append((name, *operands))
        number = len(self.program.operations) - 1
        self.sizes[number] = -1 if name == "join" else int(np.prod(shape))
        return _Value(tuple(shape), number)


def _flat(tree: Any) -> list[Any]:
    if isinstance(tree, dict):
        return [leaf for value in tree.values() for leaf in _flat(value)]
    if isinstance(tree, (tuple, list)):
        return [leaf for value in tree for leaf in _flat(value)]
    return [tree]


def _replaced(tree: Any, places: dict[int, Tensor]) -> Any:
    if isinstance(tree, dict):
        return {key: _replaced(value, places) for key, value in tree.items()}
    if isinstance(tree, (tuple, list)):
        return [_replaced(value, places) for value in tree]
    return places[id(tree)] if isinstance(tree, _Value) else tree


def _tensors(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {key: _tensors(value) for key, value in tree.items()}
    if isinstance(tree, (tuple, list)):
        return [_tensors(value) for value in tree]
    return tree.tensor if isinstance(tree, _Value) else tree


def _wrapped(result: Any) -> Any:
    if isinstance(result, Tensor):
        return _Value(tuple(result.shape), tensor=result)
    if isinstance(result, (tuple, list)):
        return [_wrapped(part) for part in result]
    return result
