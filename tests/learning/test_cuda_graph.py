"""A repeated computation runs every time it is called, whether it is replayed, not yet captured, or cannot be."""

from __future__ import annotations

import warnings

import pytest
import torch

from codesign_bench.learning import cuda_graph
from codesign_bench.learning.cuda_graph import WARM_UP, Computation, Replayed

NEEDS_GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
CPU, CUDA = torch.device("cpu"), torch.device("cuda")


class Counter:
    """Counts its calls, and those of the replay that stands for it."""

    def __init__(self) -> None:
        self.calls = self.replays = 0

    def __call__(self) -> None:
        self.calls += 1

    def replay(self) -> None:
        """Count a replay."""
        self.replays += 1


@pytest.fixture
def as_on_a_gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let streams and graphs be those of a GPU that runs everything at once."""
    monkeypatch.setattr(cuda_graph, "_beside", lambda computation: computation())
    monkeypatch.setattr(cuda_graph, "capture", lambda computation: computation.replay)


def test_on_the_processor_it_is_computed_every_time() -> None:
    computation = Counter()
    replayed = Replayed(computation, CPU)
    for _ in range(WARM_UP + 4):
        replayed()
    assert (computation.calls, replayed.captured) == (WARM_UP + 4, False)


def test_on_a_gpu_it_is_replayed_after_its_first_calls(as_on_a_gpu: None) -> None:
    computation = Counter()
    replayed = Replayed(computation, CUDA)
    for _ in range(WARM_UP + 4):
        replayed()
    assert (computation.calls, computation.replays, replayed.captured) == (WARM_UP, 4, True)


def test_where_it_cannot_be_captured_it_is_computed_and_the_log_says_so_once(
    as_on_a_gpu: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(computation: Computation) -> Computation:
        raise RuntimeError("operation not permitted\nwhen stream is capturing")

    monkeypatch.setattr(cuda_graph, "capture", refuse)
    computation = Counter()
    replayed = Replayed(computation, CUDA)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(WARM_UP + 4):
            replayed()
    assert (computation.calls, replayed.captured) == (WARM_UP + 4, False)
    (warning,) = caught
    assert str(warning.message) == (
        "no CUDA graph, so updates take longer: operation not permitted when stream is capturing"
    )


@NEEDS_GPU
def test_a_gpu_replays_it_on_the_same_memory() -> None:
    total, added = torch.zeros(3, device="cuda"), torch.ones(3, device="cuda")

    def add() -> None:
        total.add_(added)

    replayed = Replayed(add, CUDA)
    for _ in range(WARM_UP + 2):
        replayed()
    added.fill_(10.0)
    replayed()
    assert replayed.captured
    assert total.tolist() == [WARM_UP + 12.0] * 3


@NEEDS_GPU
def test_a_gpu_cannot_capture_a_question() -> None:
    total = torch.zeros(3, device="cuda")

    def ask() -> None:
        total.add_(1.0)
        float(total.sum())

    replayed = Replayed(ask, CUDA)
    for _ in range(WARM_UP):
        replayed()
    with pytest.warns(RuntimeWarning, match="no CUDA graph"):
        replayed()
    replayed()
    assert total.tolist() == [WARM_UP + 2.0] * 3
