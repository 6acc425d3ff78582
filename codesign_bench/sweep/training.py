"""Run one cell to its end in this process: train, evaluate at the marks, save checkpoints, write the results.

An interrupted cell resumes from its checkpoint, with the same curve as without the interruption, except for `wall_s`.
"""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from codesign_bench.cell.cell import Cell, ResolvedCell
from codesign_bench.evaluation.evaluate import Evaluation, evaluate, rows
from codesign_bench.machine import gpu_megabytes, peak_megabytes
from codesign_bench.method import BatchReport, Method
from codesign_bench.seeding import Streams
from codesign_bench.storage.cells import open_cell
from codesign_bench.storage.checkpoint import Checkpoint, Progress, load_checkpoint, save_checkpoint
from codesign_bench.storage.files import write_json
from codesign_bench.storage.layout import (
    CHECKPOINT_FILE,
    CURVE_COLUMNS,
    CURVE_FILE,
    EVALUATION_FILE,
    METRICS_FILE,
    PROGRESS_FILE,
    write_rows,
)
from codesign_bench.storage.policies import policy_tensors, save_policy
from codesign_bench.storage.records import Timings

CHECKPOINT_SECONDS_VARIABLE = "CODESIGN_BENCH_CHECKPOINT_SECONDS"
"""Environment variable: seconds between checkpoints (0: after every batch); every evaluation also saves one."""
CHECKPOINT_SECONDS = 20.0
PAUSE_PER_SAVE = 20.0
"""The pause after a checkpoint is at least this many times as long as writing it took. Saving thus takes at most a
twentieth of the time, apart from evaluations, for any size of a method's state."""
PROGRESS_SECONDS = 1.0


class CellRun:
    """The run of one cell; `finish` runs the rest of it."""

    def __init__(self, resolved: ResolvedCell, folder: Path) -> None:
        cell, config = self.cell, self.config = resolved.cell, resolved.config
        self.folder = folder
        self.problem = resolved.problem()
        self.streams = Streams(cell.seed)
        self.method: Method[Any] = resolved.method_class(self.problem, config.method, self.streams)
        self.problem.simulators.use_cores(config.run.threads)
        self.method.use_cores(config.run.threads)
        self.method.use_device(config.run.device)
        checkpoint = load_checkpoint(folder / CHECKPOINT_FILE)
        self.progress = Progress() if checkpoint is None else checkpoint.progress
        if checkpoint is not None:
            self.method.load_state(checkpoint.state)
            self.streams.load_state(checkpoint.streams)
        elif (before := cell.pretrained) is not None:
            self.method.start_from(policy_tensors(open_cell(before.folder(_results(cell, folder)))))
        self._interval = float(os.environ.get(CHECKPOINT_SECONDS_VARIABLE, CHECKPOINT_SECONDS))
        self._started = self._saved = time.monotonic()
        self._save_s = 0.0
        self._reported = float("-inf")
        self._earlier_wall_s = self.progress.wall_s
        self._earlier_steps = self.progress.env_steps
        self._last_evaluation: Evaluation | None = None

    def finish(self) -> None:
        """Train to the end of the budget and write all files except the cell file."""
        steps = self.config.run.steps
        self._report("training")
        if self.progress.next_mark == 0:
            self._evaluate()
        while self.progress.env_steps < steps:
            self._train(steps - self.progress.env_steps)
            if self.progress.env_steps >= self._mark(self.progress.next_mark):
                self._evaluate()
            elif time.monotonic() - self._saved >= self._pause():
                self._save()
            self._report("training")
        self._write_final()

    def timings(self) -> Timings:
        """Return the seconds of training, of evaluation, and in total, without interruptions, and the memory used."""
        progress = self.progress
        return Timings(
            train_s=progress.train_s,
            evaluate_s=progress.evaluate_s,
            wall_s=self._wall_s(),
            peak_mb=peak_megabytes(),
            gpu_mb=gpu_megabytes(),
        )

    def _train(self, remaining_steps: int) -> None:
        start = time.monotonic()
        report = self.method.train(remaining_steps)
        if report.env_steps < 1:
            raise RuntimeError(f"{self.cell.method}.train reported {report.env_steps} environment steps")
        self.progress.train_s += time.monotonic() - start
        self.progress.env_steps += report.env_steps
        self.progress.gradient_steps += report.gradient_steps
        self._add_metrics(report)

    def _add_metrics(self, report: BatchReport) -> None:
        for name, value in report.metrics.items():
            total = self.progress.pending_metrics.setdefault(name, [0.0, 0.0])
            total[0] += float(value)
            total[1] += 1.0

    def _evaluate(self) -> None:
        """Add a row to the curve and save a checkpoint; a batch that passes several marks adds only one row."""
        self._report("evaluating")
        start = time.monotonic()
        evaluation = self._last_evaluation = self._judge()
        progress = self.progress
        progress.evaluate_s += time.monotonic() - start
        progress.curve.append(
            {
                "env_steps": progress.env_steps,
                "wall_s": self._wall_s(),
                **evaluation.summary,
                "gradient_steps": progress.gradient_steps,
            }
        )
        if progress.pending_metrics:
            means = {name: total / count for name, (total, count) in progress.pending_metrics.items()}
            progress.metrics.append({"env_steps": progress.env_steps, **means})
            progress.pending_metrics = {}
        while (
            progress.next_mark <= self.config.run.evaluations and self._mark(progress.next_mark) <= progress.env_steps
        ):
            progress.next_mark += 1
        self._save()
        self._write_curve()

    def _judge(self) -> Evaluation:
        problem, policy = self.problem, self.method.policy()
        instances = problem.evaluation_instances()
        return evaluate(problem.task, policy, problem.tradeoff, instances, problem.simulators)

    def _mark(self, index: int) -> int:
        """Return the environment steps at which evaluation `index` is due: the first at 0, the last at the budget."""
        return round(index * self.config.run.steps / self.config.run.evaluations)

    def _save(self) -> None:
        start = time.monotonic()
        self.progress.wall_s = self._wall_s()
        checkpoint = Checkpoint(self.method.state(), self.streams.state(), self.progress)
        save_checkpoint(self.folder / CHECKPOINT_FILE, checkpoint)
        self._saved = time.monotonic()
        self._save_s = self._saved - start

    def _pause(self) -> float:
        """Return the minimum time between two checkpoints, s."""
        return max(self._interval, PAUSE_PER_SAVE * self._save_s) if self._interval else 0.0

    def _wall_s(self) -> float:
        return self._earlier_wall_s + time.monotonic() - self._started

    def _write_curve(self) -> None:
        write_rows(self.folder / CURVE_FILE, self.progress.curve, CURVE_COLUMNS)
        if self.progress.metrics:
            write_rows(self.folder / METRICS_FILE, self.progress.metrics)

    def _write_final(self) -> None:
        policy, task = self.method.policy(), self.problem.task
        # A cell that was killed after its last checkpoint resumes here, without an evaluation in memory.
        evaluation = self._last_evaluation or self._judge()
        self._write_curve()
        write_rows(self.folder / EVALUATION_FILE, list(rows(task, evaluation, self.problem.cutout)))
        save_policy(self.folder, policy, {"task": self.cell.task, "method": self.cell.method})

    def _report(self, phase: str) -> None:
        """Write this cell's progress to its folder, about once a second."""
        now = time.monotonic()
        if now - self._reported < PROGRESS_SECONDS:
            return
        self._reported = now
        progress, last = self.progress, self.progress.curve[-1] if self.progress.curve else {}
        content = {
            "pid": os.getpid(),
            "updated": time.time(),
            "phase": phase,
            "env_steps": progress.env_steps,
            "steps": self.config.run.steps,
            "steps_per_second": (progress.env_steps - self._earlier_steps) / max(now - self._started, 1e-9),
            "return_mean": last.get("return_mean"),
            "success_rate": last.get("success_rate"),
        }
        with suppress(OSError):  # nothing depends on it
            write_json(self.folder / PROGRESS_FILE, content, durable=False)


def _results(cell: Cell, folder: Path) -> Path:
    """Return the results folder that contains `folder`, the folder of `cell`."""
    return folder.parents[len(Path(cell.name).parts) - 1]
