"""Speed of our learners and others: in one run, on one machine, with the same batch, minibatches, epochs and task.

Every contestant runs in a separate process, so that its peak memory is measured alone; numbers are medians over
repeats.

Shapes: `n` environment steps of a batch.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rich.console import Console

from codesign_bench.benchmarks.output import write_speeds
from codesign_bench.benchmarks.workload import Speed, Workload, together
from codesign_bench.config.resolve import resolve
from codesign_bench.console import print_table, printer
from codesign_bench.errors import UserError
from codesign_bench.machine import (
    available_cores,
    computes_in_bfloat16,
    peak_megabytes,
)
from codesign_bench.method import Problem, load_method, method_names, usable_methods
from codesign_bench.processes import thread_environment
from codesign_bench.seeding import Streams
from codesign_bench.task import load_task


@dataclass(frozen=True)
class Contestant:
    """A learner and its measurement."""

    title: str
    measure: Callable[[Workload], Speed]
    needs: str = ""
    """An optional package that it needs."""


def ours(method_name: str, precision: str = "fp32") -> Callable[[Workload], Speed]:
    """Return the measurement of one of our own PPO-based methods with the networks of the work's profile."""

    def measure(work: Workload) -> Speed:
        method_class: Any = load_method(method_name)
        same = {"batch_size": work.batch_size, "minibatch_size": work.minibatch_size, "epochs": work.epochs}
        config = resolve(method_class, work.task, work.profile).method
        config = replace(config, **same, precision=precision, kl_threshold=NEVER)
        learner = method_class(Problem(load_task(work.task)), config, Streams(0)).learner
        learner.use_cores(work.cores)
        slots = max(1, round(work.batch_size / (learner.problem.task.horizon + 1)))
        rollouts, updates = [], []
        learner.collect(min(work.batch_size, 20 * slots), slots)  # starts processes and fills caches
        for _ in range(work.repeats):
            started = time.perf_counter()
            batch = learner.collect(work.batch_size, slots)
            collected = time.perf_counter()
            learner.update(batch)
            rollouts.append(batch.env_steps / (collected - started))
            updates.append(batch.env_steps * work.epochs / (time.perf_counter() - collected))
        speed = median(updates)
        per_sample = operations_per_sample(method_name, work)
        return Speed(median(rollouts), speed, peak_megabytes(), gigaflops=speed * per_sample / 1e9)

    return measure


def operations_per_sample(method_name: str, work: Workload) -> float:
    """Return the floating-point operations of matrix products per sample and epoch.

    Counted by torch on a small batch: an update with two epochs minus one with a single epoch.
    """
    from torch.utils.flop_counter import FlopCounterMode

    method_class: Any = load_method(method_name)
    counts, steps = [], 0
    for epochs in (1, 2):
        same = {"batch_size": work.minibatch_size, "minibatch_size": work.minibatch_size, "epochs": epochs}
        config = replace(resolve(method_class, work.task, work.profile).method, **same, kl_threshold=NEVER)
        learner = method_class(Problem(load_task(work.task)), config, Streams(0)).learner
        batch = learner.collect(work.minibatch_size, max(1, work.minibatch_size // (load_task(work.task).horizon + 1)))
        steps = batch.env_steps
        with FlopCounterMode(display=False) as counter:
            learner.update(batch)
        counts.append(counter.get_total_flops())
    return (counts[1] - counts[0]) / steps


NEVER = 1e6
"""A KL divergence at which no update stops."""
CEILING_REPEATS = 50
"""Number of products; the fastest is the ceiling, since other users of the machine may slow some down."""


def ceiling(work: Workload) -> dict[str, float]:
    """Return the best rate of large matrix products on `work.cores` threads, 1e9 operations/s, by precision."""
    import torch

    torch.set_num_threads(work.cores)
    rates = {}
    for name, kind in (("fp32", torch.float32), ("bf16", torch.bfloat16)):
        a, b = torch.ones(1024, 1024, dtype=kind), torch.ones(1024, 1024, dtype=kind)
        torch.mm(a, b)
        seconds = []
        for _ in range(CEILING_REPEATS):
            started = time.perf_counter()
            torch.mm(a, b)
            seconds.append(time.perf_counter() - started)
        rates[name] = 2.0 * 1024**3 / min(seconds) / 1e9
    return rates


def contestants() -> dict[str, Contestant]:
    """Return all contestants by name: every PPO-based method, and the rivals."""
    from codesign_bench.benchmarks import rivals
    from codesign_bench.learning.ppo_method import PPOMethod

    learners = [name for name in usable_methods(method_names()) if issubclass(load_method(name), PPOMethod)]
    full = {name: Contestant(f"{name}, ours", ours(name)) for name in learners}
    reduced = {
        f"{name}_bf16": Contestant(f"{name}, ours, updates in bfloat16", ours(name, "bf16")) for name in learners
    }
    return {
        **full,
        **(reduced if computes_in_bfloat16() else {}),
        "stable_baselines3": Contestant(
            "stable-baselines3, its vector environment", rivals.stable_baselines3_alone, "stable_baselines3"
        ),
        "stable_baselines3_ours": Contestant(
            "stable-baselines3, our vector environment", rivals.stable_baselines3_batched, "stable_baselines3"
        ),
        "usual_way": Contestant(
            "graph network, torch-geometric, one state per call", rivals.usual_way, "torch_geometric"
        ),
    }


HEADER = ("learner", "env steps/s", "rollout", "update samples/s", "GFLOP/s", "of fp32 ceiling", "peak MB")


def bench_learner(work: Workload, names: Sequence[str], out: Path | None, console: Console) -> None:
    """Measure the contestants `names`, print a table, and write it to `out` as JSON, if given.

    Raises:
        UserError: more cores than available, an unknown task, or a file that is not writable.
    """
    load_task(work.task)
    if work.cores * work.cells > available_cores():
        cells = f" for each of --cells {work.cells}" if work.cells > 1 else ""
        raise UserError(f"--cores {work.cores}{cells}: there are only {available_cores()}")
    known = contestants()
    say = printer(console)
    top = ceiling(work)
    found: dict[str, Speed] = {}
    for name in names:
        say(f"measuring {known[name].title} ...")
        try:
            found[name] = _in_process(name, work)
        except UserError as error:
            say(f"left out: {error}")
    rows = [(known[name].title, *_row(speed, work, top["fp32"])) for name, speed in found.items()]
    print_table(console, HEADER, rows)
    say(
        f"{work.task}, networks of the profile {work.profile}, batches of {work.batch_size:,}, "
        f"minibatches of {work.minibatch_size:,}, {work.epochs} epochs, "
        f"{work.cores} core(s) per cell, {work.cells} cell(s) at a time, medians of {work.repeats}; "
        f"matrix products: {top['fp32']:.0f} GFLOP/s in fp32, "
        f"{top['bf16']:.0f} in bf16"
    )
    for name, speed in found.items():
        if speed.how:
            say(f"{known[name].title}: {speed.how}")
    write_speeds(out, _content(work, top, found), work.cores, say)


def _row(speed: Speed, work: Workload, top: float) -> tuple[str, ...]:
    return (
        f"{speed.end_to_end(work.epochs):,.0f}",
        f"{speed.rollout:,.0f}",
        f"{speed.update:,.0f}",
        "-" if speed.gigaflops is None else f"{speed.gigaflops:.0f}",
        "-" if speed.gigaflops is None else f"{speed.gigaflops / top:.2f}",
        f"{speed.peak_megabytes:.0f}",
    )


def _content(work: Workload, top: Mapping[str, float], found: Mapping[str, Speed]) -> dict[str, Any]:
    return {
        "workload": asdict(work),
        "ceiling_gigaflops": dict(top),
        "learners": {
            name: {**asdict(speed), "env_steps_per_second": speed.end_to_end(work.epochs)}
            for name, speed in found.items()
        },
    }


def _in_process(name: str, work: Workload) -> Speed:
    """Measure a contestant in separate processes, one per cell; rates are added, memory is that of one cell.

    Raises:
        UserError: a package that it needs is not installed.
    """
    needs = contestants()[name].needs
    environment = thread_environment()
    if needs == "stable_baselines3":  # it can use more cores only as torch's threads
        environment["OMP_NUM_THREADS"] = str(work.cores)
    command = [sys.executable, "-m", __name__, name, json.dumps(asdict(work))]
    pipe = subprocess.PIPE
    cells = [subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True) for _ in range(work.cells)]
    speeds = []
    for cell, (output, errors) in [(cell, cell.communicate()) for cell in cells]:
        if cell.returncode:
            if needs and f"No module named '{needs}'" in errors:
                raise UserError(f"{needs} is not installed: pip install 'codesign-bench[bench]'")
            raise RuntimeError(f"measuring {name} failed:\n{errors}")
        speeds.append(Speed(**json.loads(output.splitlines()[-1])))
    return together(speeds)


def _main(name: str, work_json: str) -> None:
    import torch

    np.random.seed(0)  # noqa: NPY002  # the other libraries draw from the global generator
    work = Workload(**json.loads(work_json))
    torch.set_num_threads(int(os.environ["OMP_NUM_THREADS"]))
    print(json.dumps(asdict(contestants()[name].measure(work))))


if __name__ == "__main__":
    _main(*sys.argv[1:])
