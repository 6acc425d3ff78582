"""How fast cells of a kind train on this machine, and how much memory they need: from finished cells, or measured.

Of one kind are cells with the same task, method and settings, on as many threads and on the same device; seeds, budgets
and variants hardly change the speed. What was measured is kept in the user's cache, by kind and machine.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

from codesign_bench import __version__
from codesign_bench.cell.cell import Cell, ResolvedCell, resolve_cell
from codesign_bench.evaluation.evaluate import evaluate
from codesign_bench.machine import gpu_megabytes, host_facts, peak_megabytes
from codesign_bench.plugins import import_modules
from codesign_bench.processes import python_process, watched_by_parent
from codesign_bench.seeding import Streams
from codesign_bench.storage.files import write_json
from codesign_bench.storage.json_fields import number, optional
from codesign_bench.storage.reading import UnusableFile, read_json
from codesign_bench.storage.records import DONE, CellRecord
from codesign_bench.sweep.cell_process import pin_threads
from codesign_bench.sweep.workers import describe_exit

Kind: TypeAlias = str
"""A digest of what the speed of a cell depends on, the machine included."""
SECONDS = 5.0
"""A measurement trains for at least so long after the first batch, which starts processes and fills caches."""
CACHE_VARIABLE = "XDG_CACHE_HOME"
FINISHED, MEASURED = "finished cells", "measured"


@dataclass(frozen=True)
class Pace:
    """The speed and size of a cell."""

    steps_per_second: float
    """Environment steps per second of training, updates included."""
    evaluation_s: float
    """Seconds of one evaluation."""
    peak_mb: float | None
    """Memory of its processes, MB; None: not recorded."""
    source: str
    gpu_mb: float | None = None
    """Memory on the GPU, MB; None: it uses none."""

    def seconds(self, steps: int, evaluations: float) -> float:
        """Return how long training takes for so many steps, with so many evaluations."""
        return steps / self.steps_per_second + evaluations * self.evaluation_s


def kind_of(resolved: ResolvedCell) -> Kind:
    """Return the kind of a cell on this machine, for this version of the package."""
    config = resolved.config.stored()
    return _digest(
        task=resolved.cell.task,
        task_version=resolved.task.version,
        method=resolved.cell.method,
        settings={name: value for name, (value, _) in config.method.items()},
        threads=resolved.config.run.threads,
        device=resolved.config.run.device,
        host=_this_machine(),
    )


def kind_of_record(record: CellRecord) -> Kind:
    """Return the kind of a stored cell, on the machine that ran it; for the version of this package."""
    return _digest(
        task=record.task,
        task_version=record.task_version,
        method=record.method,
        settings={name: value for name, (value, _) in record.config.method.items()},
        threads=record.threads,
        device=record.config.run.get("device", ("cpu", ""))[0],
        host=_machine(record.host),
    )


@cache
def _this_machine() -> list[Any]:
    """Return what `_machine` does of this one; once, since a sweep asks for every cell."""
    return _machine(host_facts(threads=1))


def _machine(host: Mapping[str, Any]) -> list[Any]:
    return [host.get(name) for name in ("name", "cpu", "cores")]


def _digest(**parts: Any) -> Kind:
    text = json.dumps({**parts, "version": __version__}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def of_finished(records: Iterable[CellRecord]) -> dict[Kind, Pace]:
    """Return the mean pace of the finished cells of each kind."""
    by_kind: dict[Kind, list[CellRecord]] = {}
    for record in records:
        if record.status == DONE and _is_timed(record):
            by_kind.setdefault(kind_of_record(record), []).append(record)
    return {kind: _mean(same) for kind, same in by_kind.items()}


def _is_timed(record: CellRecord) -> bool:
    """Return whether a record has times and counts that a pace follows from: others' files may hold anything."""
    train_s, evaluate_s = record.timings.train_s, record.timings.evaluate_s
    if train_s is None or evaluate_s is None:
        return False
    return train_s > 0.0 and evaluate_s >= 0.0 and record.env_steps > 0 and _evaluations(record) > 0


def _evaluations(record: CellRecord) -> int:
    """Return how often a finished cell was evaluated, the untrained policy included; 0 if its file does not say."""
    entry = record.config.run.get("evaluations")
    return 1 + entry.value if entry is not None and type(entry.value) is int and entry.value > 0 else 0


def _mean(records: list[CellRecord]) -> Pace:
    trained = sum(record.timings.train_s or 0.0 for record in records)
    evaluated = sum(record.timings.evaluate_s or 0.0 for record in records)
    steps, evaluations = (sum(map(count, records)) for count in (lambda record: record.env_steps, _evaluations))
    peak_mb, gpu_mb = (
        max((each for record in records if (each := getattr(record.timings, name) or 0.0) > 0.0), default=None)
        for name in ("peak_mb", "gpu_mb")
    )
    return Pace(steps / trained, evaluated / evaluations, peak_mb, FINISHED, gpu_mb)


def cache_file() -> Path:
    """Return where measured paces are kept."""
    folder = os.environ.get(CACHE_VARIABLE) or Path.home() / ".cache"
    return Path(folder) / "codesign-bench" / "paces.json"


def measured_before() -> dict[Kind, Pace]:
    """Return the paces in the cache; none if it cannot be read."""
    try:
        content = read_json(cache_file())
        return {kind: _pace(values) for kind, values in content.items()}
    except (OSError, UnusableFile, ValueError, KeyError, TypeError, AttributeError, RuntimeError):
        return {}  # nothing depends on it


def _pace(values: Mapping[str, Any]) -> Pace:
    steps_per_second, evaluation_s = number(values, "steps_per_second"), number(values, "evaluation_s")
    if not (steps_per_second > 0.0 and evaluation_s >= 0.0):
        raise ValueError("not a speed")
    peak_mb, gpu_mb = (optional(number, values, name) for name in ("peak_mb", "gpu_mb"))
    return Pace(steps_per_second, evaluation_s, peak_mb, MEASURED, gpu_mb)


def remember(paces: Mapping[Kind, Pace]) -> None:
    """Add paces to the cache, if it can be written."""
    with suppress(OSError, RuntimeError):  # the next one measures again; a user may have no home
        path = cache_file()
        path.parent.mkdir(parents=True, exist_ok=True)
        kept = {**measured_before(), **paces}
        write_json(path, {kind: asdict(pace) for kind, pace in kept.items()}, durable=False)


class NotTimed(Exception):
    """A cell failed while it was timed; the message is the last line that it wrote."""


def measure(resolved: ResolvedCell, at_a_time: int = 1) -> list[Pace]:
    """Train so many equal cells of a kind side by side for some seconds, each in its process; return their paces.

    Raises:
        NotTimed: a process failed.
    """
    with ExitStack() as files:
        logs = [files.enter_context(tempfile.TemporaryFile("w+")) for _ in range(at_a_time)]
        processes = [python_process(__name__, resolved.cell.to_json(), stderr=log) for log in logs]
        try:
            # Not `communicate`, which would close the pipe by which they know that this process is alive.
            outputs = ["" if process.stdout is None else process.stdout.read() for process in processes]
            codes = [process.wait() for process in processes]
        finally:
            for process in processes:
                if process.poll() is None:
                    process.kill()
                    process.wait()
        for code, log in zip(codes, logs, strict=True):
            if code:
                log.seek(0)
                lines = log.read().strip().splitlines() or [describe_exit(code)]
                raise NotTimed(f"{resolved.cell.task}/{resolved.cell.method} cannot be timed: {lines[-1]}")
    return [_pace(json.loads(output.splitlines()[-1])) for output in outputs]


def measure_here(resolved: ResolvedCell) -> Pace:
    """Train a cell in this process for some seconds, evaluate it once, and return its pace."""
    config, problem, budget = resolved.config, resolved.problem(), resolved.config.run.steps
    method = resolved.method_class(problem, config.method, Streams(resolved.cell.seed))
    problem.simulators.use_cores(config.run.threads)
    method.use_cores(config.run.threads)
    method.use_device(config.run.device)
    done, begun = 0, time.monotonic()
    timed_steps, timed_from = 0, begun
    while done < budget and (timed_steps == 0 or time.monotonic() - timed_from < SECONDS):
        report = method.train(budget - done)
        if done == 0 and report.env_steps < budget:
            timed_from = time.monotonic()  # from the second batch on
        else:
            timed_steps += report.env_steps
        done += report.env_steps
    trained_s, started = time.monotonic() - timed_from, time.monotonic()
    evaluate(problem.task, method.policy(), problem.tradeoff, problem.evaluation_instances(), problem.simulators)
    return Pace(timed_steps / trained_s, time.monotonic() - started, peak_megabytes(), MEASURED, gpu_megabytes())


def start() -> None:
    """Measure the cell that the first argument gives as JSON, as a separate process; print its pace as JSON."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    watched_by_parent()
    import_modules([])
    resolved = resolve_cell(Cell.from_json(sys.argv[1]))
    pin_threads()
    print(json.dumps(asdict(measure_here(resolved))), flush=True)
    os._exit(0)  # as a cell's process does
