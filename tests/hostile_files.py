"""Damaged and hostile files in a results folder, each read by every command: by hand, longer than in the tests.

For each damage a results folder is made, one file of it damaged, and one command run. The command must end in time and
within its memory, without a traceback, and name the damaged file if it would read it. From the root of the repository:

    .venv/bin/python tests/hostile_files.py              every combination, in some hours
    .venv/bin/python tests/hostile_files.py --every 20   one in twenty, drawn once and for all
    .venv/bin/python tests/hostile_files.py --only curve.csv status

Commands run in processes that stay; one that hangs is killed and replaced.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

TESTS = Path(__file__).resolve().parent
sys.path.insert(0, str(TESTS))
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hostile_damages import (  # noqa: E402  # with a safe path, Python does not search this folder by itself
    AROUND,
    CONTROLS,
    OF_ANY_FILE,
    OF_LARGE_ARRAYS,
    OF_SETTINGS,
    Change,
    Damage,
    of_a_cell_file,
    of_a_policy,
    of_a_table,
)

SECONDS = 120.0
"""A command that takes longer hangs: the slowest takes ten."""
MEMORY = 2**30
"""Bytes that a command may use beyond those of the libraries."""
SEED = "toy_reach/toy_search/default/seed-01"
CELL = "fetch_cube/gnn_ppo/default/seed-00"

FOLDER_COMMANDS = ("status", "plot", "verify", "report", "load_results")
CELL_COMMANDS = ("render", "export", "deploy", "load_policy")
RUN, RESUME, TUNED = "run", "resume", "tuned"
INTERRUPTED = "toy_reach/toy_search/default/seed-03"
LARGE = "checkpoint.large-1.npz"


# The folder.

TABLES: Mapping[str, str] = {
    "reference_points.csv": "return_mean",
    "reference_points.instances.csv": "return",
    "design_sensitivity/toy_reach.csv": "outcome",
    "outside_region/toy_reach-toy_search.csv": "return",
    "cutout_regions/toy_reach-toy_search.csv": "return",
    "deployment/toy_reach/protocol.csv": "outcome",
    "headroom/toy_reach-toy_search-seed-00.csv": "best_return",
    "design_values/toy_reach-toy_search-seed-00.csv": "value",
    "best_known/toy_reach.csv": "return",
}
"""Tables beside the cells, each with a column of numbers."""


def make_results(out: Path) -> None:
    """Make the folder: three finished toy cells, one of an earlier version with a policy, and a table of each kind."""
    from builders import VERSION_0_1_0, store_table, sweep, toy_cells
    from codesign_bench.storage.measurements import ALL

    sweep(toy_cells(3), out)
    _interrupt(out / SEED, out / INTERRUPTED)
    (out / "tuned.json").write_text(json.dumps({"winners": [WINNER]}))
    shutil.copytree(VERSION_0_1_0 / CELL, out / "one" / CELL)
    for path, kind in zip(TABLES, ALL, strict=True):
        group, last = (kind.form.alike or kind.form.unique)[-1], kind.form.unique[-1]
        places = [(one, other) for one in range(2) for other in range(4)]
        rows = [{group: _value(group, one), last: _value(last, 4 * one + other)} for one, other in places]
        store_table(out / path, kind, *({"task": "toy_reach", **row} for row in rows))


def _value(column: str, number: int) -> str | int:
    return f"point {number}" if column == "point" else number


WINNER = {"task": "toy_reach", "method": "toy_search", "set": ["step_size=0.3"]}


def _interrupt(done: Path, folder: Path) -> None:
    """Make a cell that was interrupted in the middle, with a checkpoint and large arrays."""
    import numpy as np

    from codesign_bench.method import State
    from codesign_bench.storage.checkpoint import Checkpoint, Progress, save_checkpoint

    shutil.copytree(done, folder)
    for name in ("curve.csv", "evaluation.csv", "policy.safetensors"):
        (folder / name).unlink()
    values = json.loads((folder / "cell.json").read_text())
    values |= {"status": "running", "seed": 3, "checksums": {}}
    (folder / "cell.json").write_text(json.dumps(values))
    state = State({"best": np.zeros(2)}, {"best_return": 0.0, "env_steps": 100}, {"buffer": np.arange(1000.0)})
    save_checkpoint(folder / "checkpoint.safetensors", Checkpoint(state, {}, Progress(env_steps=100)))


def damages() -> Iterator[tuple[Damage, tuple[str, ...]]]:
    """Yield every damage with the commands that run on it."""
    on_cells = (*FOLDER_COMMANDS, RUN)
    for name, change, named in of_a_cell_file():
        # The folder of one cell may be anywhere, and cells of version 0.1.0 have no such entry.
        moved = name.startswith(("another ", "'axes'"))
        yield Damage(f"{SEED}/cell.json", name, change, named), on_cells
        yield Damage(f"one/{CELL}/cell.json", name, change, named and not moved), CELL_COMMANDS
    for file, column in (("curve.csv", "return_mean"), ("evaluation.csv", "return")):
        for name, change in {**OF_ANY_FILE, **of_a_table(column), "missing": Path.unlink}.items():
            yield Damage(f"{SEED}/{file}", name, change), on_cells
    for name, change in OF_ANY_FILE.items():
        yield Damage(f"{SEED}/cell.json", name, change), on_cells
        yield Damage(f"one/{CELL}/cell.json", name, change), CELL_COMMANDS
        yield Damage(f"{SEED}/policy.safetensors", name, change), on_cells
        yield Damage(f"{SEED}/metrics.csv", name, change, named=False), on_cells
        yield Damage(f"{SEED}/output.log", name, _beside(change), named=False), on_cells
        yield Damage(f"one/{CELL}/policy.safetensors", name, change), CELL_COMMANDS
    for name, change in of_a_policy().items():
        yield Damage(f"one/{CELL}/policy.safetensors", name, change), CELL_COMMANDS
    for path, column in TABLES.items():
        for name, change in {**OF_ANY_FILE, **of_a_table(column)}.items():
            harmless = name == "a row less" and path in ("reference_points.csv",)
            yield Damage(path, name, change, named=not harmless), FOLDER_COMMANDS
    yield Damage(f"{SEED}/cell.json", "missing", Path.unlink), FOLDER_COMMANDS
    structural = {
        name: change for name, change in of_a_policy().items() if "arrays" not in name and "numbers" not in name
    }
    for name, change in {**OF_ANY_FILE, **structural}.items():
        yield Damage(f"{INTERRUPTED}/checkpoint.safetensors", name, change), (RESUME,)
    for name, change in {**OF_ANY_FILE, **OF_LARGE_ARRAYS}.items():
        yield Damage(f"{INTERRUPTED}/{LARGE}", name, change, named=name not in AROUND), (RESUME,)
    for name, change in {**OF_ANY_FILE, **OF_SETTINGS}.items():
        yield Damage("tuned.json", name, change), (TUNED,)


def _beside(change: Change) -> Change:
    """Return the same change to a file that is made first."""

    def on(path: Path) -> None:
        path.write_text("a\n")
        change(path)

    return on


def combinations() -> list[tuple[Damage, str]]:
    """Return every damage with every command that runs on it."""
    return [(damage, command) for damage, commands in damages() for command in commands]


# One combination, in a process that stays.


def call(command: str, results: Path, out: Path) -> tuple[int, str]:
    """Run a command in this process; return its exit code and all that it printed."""
    from codesign_bench import UserError, load_policy, load_results
    from codesign_bench.cli import main

    cell = str(results / "one" / CELL)
    lines: dict[str, list[str]] = {
        "status": ["status", "--results", str(results)],
        "plot": ["plot", "--results", str(results), "--out", str(out / "figures")],
        "verify": ["verify", "--results", str(results), "--out", str(out / "claims")],
        "report": ["report", "--results", str(results), "--out", str(out / "report.html")],
        "render": ["render", "--policy", cell, "--episodes", "1", "--out", str(out / "a.png")],
        "export": ["export", "--policy", cell, "--instances", "0", "--out", str(out / "tools")],
        "deploy": ["deploy", "--policy", cell, "--tool", "1", "--no-gifs", "--out", str(out / "deployed")],
        "run": [
            *("run", "--method", "toy_search", "--task", "toy_reach", "--seeds", "3", "--steps", "200"),
            *("--set", "evaluations=4", "--out", str(results)),
        ],
    }
    lines[RESUME] = [word if word != "3" else "3-3" for word in lines[RUN]]
    lines[TUNED] = [*lines[RUN], "--tuned", str(results / "tuned.json")]
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed), warnings.catch_warnings():
        warnings.simplefilter("always")
        if command in lines:
            code = main([*lines[command], "--import", "toy"])
        else:
            try:
                load_results(results) if command == "load_results" else load_policy(cell)
                code = 0
            except UserError as error:
                print(error)
                code = 2
    return code, printed.getvalue()


def judge(damage: Damage, command: str, base: Path, work: Path) -> str:
    """Return what was wrong when a command met a damage, "" if nothing was."""
    results, out = work / "runs", work / "out"
    shutil.copytree(base, results, symlinks=True)
    out.mkdir()
    damage.change(results / damage.path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        code, printed = call(command, results, out)
    except Exception:
        return "a traceback: " + traceback.format_exc()
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    if grown > MEMORY:
        return f"took {grown / 2**20:.0f} MB"
    if "Traceback (most recent call last)" in printed:
        return f"printed a traceback: {printed}"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    name, folder = Path(damage.path).name, Path(damage.path).parent.name
    if damage.named and not (name in printed and (folder in printed or folder == "")):
        return f"did not name {damage.path}; exit code {code}; printed: {printed[-2000:]}"
    if command == "report" and damage.named and code == 0 and name not in (out / "report.html").read_text():
        return "the page does not name it"
    if any(control in printed for control in CONTROLS):
        return f"printed a control character: {printed!r}"
    if not damage.named and code == 2 and damage.name.startswith("a label with"):
        return f"refused: {printed}"
    left = [path for path in out.rglob(".*") if path.name.endswith(".partial")]
    return f"left {left}" if left else ""


def serve(base: Path) -> int:
    """Judge the combinations whose numbers come in on standard input, and answer each with a line of JSON."""
    from codesign_bench.plugins import import_modules

    answers = os.fdopen(os.dup(1), "w")
    os.environ["PYTHONPATH"] = str(TESTS)
    import_modules(["toy"])
    listed = combinations()
    import matplotlib.pyplot  # noqa: F401
    import torch  # noqa: F401

    status = Path("/proc/self/statm").read_text().split()
    limit = int(status[0]) * resource.getpagesize() + 3 * MEMORY  # numerical libraries reserve more than they use
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    for line in sys.stdin:
        with tempfile.TemporaryDirectory() as work:
            wrong = judge(*listed[int(line)], base, Path(work))
        print(json.dumps(wrong), file=answers, flush=True)
    return 0


class Server:
    """A process that judges, replaced when it hangs."""

    def __init__(self, base: Path) -> None:
        self._command = [sys.executable, __file__, "--serve", str(base)]
        self._process: subprocess.Popen[str] | None = None

    def judge(self, number: int) -> str:
        """Return what was wrong with a combination."""
        import select

        if self._process is None:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{number}\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], SECONDS)[0]:
            self.stop()
            return f"no end after {SECONDS:.0f} s"
        answer = self._process.stdout.readline()
        if answer:
            return str(json.loads(answer))
        self.stop()
        return "its process died"

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None


def campaign(numbers: list[int]) -> list[str]:
    """Judge combinations; return a line for each that went wrong."""
    listed, wrong = combinations(), []
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder) / "base"
        made = subprocess.run([sys.executable, __file__, "--make", str(base)], capture_output=True, text=True)
        assert made.returncode == 0, made.stderr
        server = Server(base)
        try:
            for count, number in enumerate(numbers):
                if count % 100 == 0:
                    print(f"{count} of {len(numbers)}", file=sys.stderr, flush=True)
                damage, command = listed[number]
                if answer := server.judge(number):
                    wrong.append(f"{number} {command}: {damage.path}: {damage.name}: {answer}")
                    print(wrong[-1], flush=True)
        finally:
            server.stop()
    return wrong


def main() -> int:
    """Judge what the command line chooses; return 1 if anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first combination")
    parser.add_argument("--only", nargs="+", default=[], metavar="WORD", help="combinations with these words")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--make", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve is not None:
        return serve(options.serve)
    if options.make is not None:
        from codesign_bench.plugins import import_modules

        os.environ["PYTHONPATH"] = str(TESTS)
        import_modules(["toy"])
        make_results(options.make)
        return 0
    listed = combinations()
    texts = [f"{command} {damage.path} {damage.name}" for damage, command in listed]
    numbers = [number for number, text in enumerate(texts) if all(word in text for word in options.only)]
    random.Random(0).shuffle(numbers)  # commands take turns: every fourth would always be the same one
    numbers = numbers[options.first :: options.every]
    started = time.monotonic()
    wrong = campaign(numbers)
    print(f"{len(numbers) - len(wrong)} of {len(numbers)} combinations are right, {time.monotonic() - started:.0f} s")
    print(dict(Counter(line.split()[1] for line in wrong)))
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
