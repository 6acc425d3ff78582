"""Break file operations of a sweep one by one: each fails with an error of the system, or the process is killed there.

    python tests/injected_faults.py            every operation of a cell's process and of the main process, every fault
    python tests/injected_faults.py --every 7  every seventh operation

Every sweep runs in a child that is forked after all imports, so that a run takes a tenth of a second. File operations
are counted by an audit hook of Python, which may raise an error in place of the operation; writing and syncing, which
no hook sees, are wrapped.
"""

from __future__ import annotations

import argparse
import errno
import io
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO
from unittest import mock

from rich.console import Console

from codesign_bench.cell.cell import Cell, resolve_cells
from codesign_bench.cell.grid import grid
from codesign_bench.errors import UserError
from codesign_bench.storage.records import FAILED, CellRecord
from codesign_bench.sweep import cell_process, workers
from codesign_bench.sweep.runner import run_sweep

MAIN, CELL = "main", "cell"
KILL = 0
"""In place of an error's number: the process is killed."""
NEVER = 10**9
FAULTS = {
    "killed": KILL,
    "no space": errno.ENOSPC,
    "quota": errno.EDQUOT,
    "no answer": errno.EIO,
    "no locks": errno.ENOLCK,
    "permission": errno.EACCES,
}
WRITING_ONLY = (errno.ENOSPC, errno.EDQUOT)
PATHS = {"open": 0, "os.rename": 1, "os.remove": 0, "os.mkdir": 0, "os.chmod": 0, "os.listdir": 0, "os.scandir": 0}
"""Audited operation -> the place of the path among its arguments."""
LOCKING = "fcntl.flock"
WRITES = ("write", "sync", "os.rename", "os.mkdir")
CELLS = tuple(grid(tasks=["toy_reach"], methods=["toy_search"], seeds=range(1), steps=60, overrides=("evaluations=2",)))


@dataclass(frozen=True)
class Fault:
    """What goes wrong, in which process, and at which of its operations in the results folder."""

    where: str
    at: int = NEVER
    number: int = KILL
    lasting: bool = False
    """Whether all later operations of the kind fail as well, as on a full disk."""

    def concerns(self, operation: str, flags: int) -> bool:
        """Return whether an operation can fail in this way."""
        if self.number == errno.ENOLCK:
            return operation == LOCKING
        if self.number in WRITING_ONLY:
            return operation in WRITES or (operation == "open" and bool(flags & (os.O_CREAT | os.O_TRUNC)))
        return True


class Injection:
    """Counts the operations of this process below a folder and lets one of them, or all from it on, fail."""

    def __init__(self, folder: Path, fault: Fault) -> None:
        self.folder, self.fault = os.path.realpath(folder), fault
        self.count = 0

    def start(self) -> None:
        """Count from now on; it cannot be undone, so do this in a child."""
        fsync, fdopen = os.fsync, os.fdopen

        def syncing(descriptor: int) -> None:
            self._operate("sync", _path_of(descriptor))
            fsync(descriptor)

        def opening(descriptor: int, *arguments: Any, **options: Any) -> Any:
            stream, path = fdopen(descriptor, *arguments, **options), _path_of(descriptor)
            if isinstance(stream, io.BufferedWriter):
                return _Watched(stream, lambda: self._operate("write", path))
            return stream

        os.fsync, os.fdopen = syncing, opening
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in PATHS:
            flags = arguments[2] if event == "open" and isinstance(arguments[2], int) else 0
            self._operate(event, arguments[PATHS[event]], flags)
        elif event == LOCKING:
            self._operate(event, _path_of(arguments[0]))

    def _operate(self, operation: str, path: Any, flags: int = 0) -> None:
        if not isinstance(path, (str, bytes, os.PathLike)) or not self._is_inside(os.fsdecode(path)):
            return
        if not self.fault.concerns(operation, flags):
            return
        index, self.count = self.count, self.count + 1
        if index == self.fault.at or (self.fault.lasting and index > self.fault.at):
            if self.fault.number == KILL:
                os.kill(os.getpid(), signal.SIGKILL)
            raise OSError(self.fault.number, os.strerror(self.fault.number), os.fsdecode(path))

    def _is_inside(self, path: str) -> bool:
        return f"{os.path.abspath(path)}/".startswith(f"{self.folder}/")


class _Watched(io.BufferedIOBase):
    """A binary stream that announces every write."""

    def __init__(self, stream: io.BufferedWriter, announce: Callable[[], None]) -> None:
        self._stream, self._announce = stream, announce

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, content: Any) -> int:
        self._announce()
        return self._stream.write(content)

    def flush(self) -> None:
        self._stream.flush()

    def fileno(self) -> int:
        return self._stream.fileno()

    def close(self) -> None:
        self._stream.close()

    def __exit__(self, *exception: object) -> None:
        self._stream.close()


def _path_of(descriptor: Any) -> str:
    try:
        return os.readlink(f"/proc/self/fd/{descriptor}")
    except OSError:
        return ""


def in_child(call: Callable[[], int], log: BinaryIO) -> int:
    """Return the exit code of `call` in a forked child, negative for a signal; its output goes to `log`."""
    return os.waitstatus_to_exitcode(os.waitpid(fork(call, log), 0)[1])


def fork(call: Callable[[], int], log: BinaryIO) -> int:
    """Call `call` in a forked child, whose output goes to `log`, and return the child's process id."""
    pid = os.fork()
    if pid == 0:
        code = 70
        try:
            # Of Python's own streams pytest has made others, which are not the descriptors 1 and 2.
            sys.stdout = sys.stderr = io.TextIOWrapper(log, encoding="utf-8", write_through=True)
            code = call()
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()  # as a cell's process does; what is still buffered would be lost
            os._exit(code)
    return pid


@dataclass(frozen=True)
class Ended:
    """How a sweep ended: its exit code, what it printed, and the number of operations that could have failed."""

    code: int
    text: str
    operations: int


def run(out: Path, fault: Fault, cells: tuple[Cell, ...] = CELLS) -> Ended:
    """Run a sweep in which one operation of the main process, or of the process of every cell, fails."""
    log, counted = out.with_name(f"{out.name}.log"), out.with_name(f"{out.name}.count")
    log.unlink(missing_ok=True)

    def tally(injection: Injection) -> None:
        counted.write_text(str(injection.count))

    def of_a_cell(job: workers.Job, folder: Path) -> int:
        def call() -> int:
            injection = Injection(out, fault if fault.where == CELL else Fault(CELL))
            injection.start()
            code = cell_process.main([job.cell.to_json(), job.out, *(["retry"] if job.retry_failed else [])])
            if fault.where == CELL:
                tally(injection)
            return code

        with workers._open_log(folder) as of_the_cell:
            return in_child(call, of_the_cell)

    def sweep() -> int:
        injection = Injection(out, fault if fault.where == MAIN else Fault(MAIN))
        with mock.patch.object(workers, "_run_process", of_a_cell):
            injection.start()
            try:
                return run_sweep(resolve_cells(list(cells)), out, console=Console(width=300), jobs=1)
            except UserError as error:
                print(error, flush=True)
                return 2
            finally:
                if fault.where == MAIN:
                    tally(injection)

    with open(log, "ab") as stream:
        code = in_child(sweep, stream)
    return Ended(code, log.read_text(), int(counted.read_text()) if counted.exists() else 0)


def content(out: Path) -> dict[str, bytes]:
    """Return the files below a results folder that two runs of the same cells share; the curve without seconds."""
    found = {}
    for path in sorted(out.rglob("*")):
        if path.is_file():
            name = path.relative_to(out).as_posix()
            text = path.read_bytes()
            if path.name == "curve.csv":
                text = b"\n".join(b",".join(line.split(b",")[:1] + line.split(b",")[2:]) for line in text.splitlines())
            found[name] = b"" if path.name == "cell.json" else text
    return found


def complaints(folder: Path, fault: Fault, undisturbed: dict[str, bytes]) -> Iterator[str]:
    """Yield what is wrong with a sweep that meets the fault and is then repeated without one."""
    out = folder / "results"
    first = run(out, fault)
    if "Traceback" in first.text and fault.number != KILL:
        yield f"a traceback: {first.text}"
    if fault.number != KILL and first.code not in (0, 1, 2):
        yield f"exit code {first.code}: {first.text}"
    if fault.number != KILL and first.code != 0 and os.strerror(fault.number) not in first.text:
        yield f"no reason: {first.text}"
    momentary = fault.number not in (KILL, errno.EACCES)
    for cell in CELLS if momentary else ():
        record = _record(cell.folder(out))
        if record is not None and record.status == FAILED:
            yield f"failed instead of interrupted: {first.text}"
    again = run(out, Fault(MAIN))
    if again.code != 0 and "failed earlier" not in again.text:
        yield f"not resumable: {again.text}"
    elif again.code == 0 and content(out) != undisturbed:
        names = {name for name in {*content(out), *undisturbed} if content(out).get(name) != undisturbed.get(name)}
        yield f"different from an undisturbed run: {sorted(names)}"


def _record(folder: Path) -> CellRecord | None:
    try:
        return CellRecord.read(folder)
    except UserError:
        return None


def start_together(folder: Path, count: int) -> list[Ended]:
    """Start sweeps on one new folder at the same moment and return how they ended."""
    out, (reading, writing) = folder / "together", os.pipe()

    def sweep() -> int:
        os.close(writing)
        os.read(reading, 1)  # returns in all of them at once, when the last writer closes
        try:
            return run_sweep(resolve_cells(list(CELLS)), out, console=Console(width=300), jobs=1)
        except UserError as error:
            print(error, flush=True)
            return 2

    logs = [folder / f"{number}.log" for number in range(count)]
    streams = [open(log, "ab") for log in logs]  # noqa: SIM115  # closed below
    children = [fork(sweep, stream) for stream in streams]
    os.close(writing)
    codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    os.close(reading)
    for stream in streams:
        stream.close()
    return [Ended(code, log.read_text(), 0) for code, log in zip(codes, logs, strict=True)]


def campaign(folder: Path, every: int = 1, first: int = 0) -> Iterator[tuple[Fault, list[str]]]:
    """Yield each fault with the complaints about it: every `every`-th operation, with each kind of fault in turn."""
    run(folder / "undisturbed", Fault(MAIN))
    undisturbed = content(folder / "undisturbed")
    for where in (MAIN, CELL):
        for name, number in FAULTS.items():
            for lasting in (False,) if number == KILL else (False, True):
                probe = folder / f"{where}-{name}-{lasting}"
                for at in range(first, run(probe, Fault(where, number=number)).operations, every):
                    fault = Fault(where, at, number, lasting)
                    place = Path(tempfile.mkdtemp(dir=folder))
                    yield fault, list(complaints(place, fault, undisturbed))


def main() -> int:
    """Run the campaign and print what is wrong; return 1 if anything is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1, help="break only every N-th operation")
    options = parser.parse_args()
    total = wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for fault, found in campaign(Path(folder), options.every):
            total += 1
            wrong += bool(found)
            for line in found:
                print(fault, line, flush=True)
    print(f"{total - wrong} of {total} faults are as they should be")
    return int(wrong > 0)


if __name__ == "__main__":
    from codesign_bench.plugins import import_modules

    sys.path.insert(0, os.path.dirname(__file__))
    os.environ["PYTHONPATH"] = os.path.dirname(__file__)
    import_modules(["toy"])
    sys.exit(main())
