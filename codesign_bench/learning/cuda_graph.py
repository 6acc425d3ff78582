"""A computation that is repeated on the same memory: a GPU replays it as one CUDA graph.

A small network's step is hundreds of kernels of microseconds each, and starting them one by one takes the processor
several times as long as the GPU needs to run them. A graph starts them all at once.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import torch

Computation = Callable[[], None]
"""Reads and writes the same memory in every call, and never asks the device for a value."""
WARM_UP = 3
"""Calls before a computation is captured: libraries allocate their workspaces, optimizers their moments."""


class Replayed:
    """Runs a computation: the first times as it is, then as a CUDA graph if the device has them."""

    def __init__(self, computation: Computation, device: torch.device) -> None:
        self._computation, self._device = computation, device
        self._calls = 0
        self._replay: Computation | None = None
        self._refused = device.type != "cuda"

    @property
    def captured(self) -> bool:
        """Whether calls replay a graph."""
        return self._replay is not None

    def __call__(self) -> None:
        """Run the computation once."""
        if self._replay is None and not self._refused and self._calls >= WARM_UP:
            self._capture()
        self._calls += 1
        if self._replay is not None:
            self._replay()
        elif self._refused:
            self._computation()
        else:
            _beside(self._computation)

    def _capture(self) -> None:
        """Capture the computation, which this does not run; where that is impossible, say so once."""
        try:
            self._replay = capture(self._computation)
        except RuntimeError as error:  # torch names no narrower one
            self._refused = True
            reason = " ".join(str(error).split())
            warnings.warn(f"no CUDA graph, so updates take longer: {reason}", RuntimeWarning, stacklevel=3)


def capture(computation: Computation) -> Computation:
    """Return the replay of a computation as a CUDA graph.

    Raises:
        RuntimeError: the computation does what a graph cannot, e.g. asks the device for a value.
    """
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        computation()
    replay: Computation = graph.replay
    return replay


def _beside(computation: Computation) -> None:
    """Run a computation in a stream of its own, as one must that is captured later (torch, "CUDA Graphs")."""
    side = torch.cuda.Stream()
    side.wait_stream(torch.cuda.current_stream())
    with torch.cuda.stream(side):
        computation()
    torch.cuda.current_stream().wait_stream(side)
