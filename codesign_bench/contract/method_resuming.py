"""Checks of interrupting a method: from a checkpoint, it goes on as if nothing had happened."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

from codesign_bench.contract.check import Fault, counted, promised
from codesign_bench.contract.subject import BUDGET, Subject, differing_state
from codesign_bench.storage.checkpoint import Checkpoint, Progress, load_checkpoint, save_checkpoint

BATCHES = 2
STATE = "codesign_bench.method.Method.state"


@promised("An interrupted method resumes from its checkpoint to the last bit.", STATE)
def resumes_to_the_bit(subject: Subject) -> Iterator[Fault]:
    """Yield what is lost on the way through a checkpoint."""
    method, left = subject.make(), BUDGET
    for _ in range(BATCHES):
        left -= method.train(left).env_steps
    state = method.state()
    for name, value in state.values.items():
        try:
            json.dumps(value)
        except (TypeError, ValueError):
            yield Fault(
                f"`values` of the state has {name}, a {type(value).__name__}", "JSON values; arrays are `arrays`"
            )
            return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "checkpoint"
        save_checkpoint(path, Checkpoint(state, method.streams.state(), Progress()))
        restored, checkpoint = subject.make(), load_checkpoint(path)
    assert checkpoint is not None
    restored.load_state(checkpoint.state)
    restored.streams.load_state(checkpoint.streams)
    yield from subject.acting_unlike(method.policy(), restored.policy(), "the policy of the resumed method")
    for batch in range(BATCHES):
        report, again = method.train(left), restored.train(left)
        if report != again:
            yield Fault(f"batch {batch} after resuming reports something else", "what it reports without interruption")
            break
        left -= report.env_steps
    if differing := differing_state(method, restored):
        yield Fault(
            f"after {BATCHES} more batches, other states: {counted(differing)}",
            "`state` holds everything that training changes, `load_state` restores it",
        )
