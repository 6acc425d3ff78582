"""Damaged and hostile files in a results folder, each read by every command: by hand, longer than in the tests.

For each damage a results folder is made, one file of it damaged, and one command run. The command must end in time and
within its memory, without a traceback, and name the damaged file if it would read it. From the root of the repository:

    .venv/bin/python tests/hostile_files.py              every combination, in some hours
    .venv/bin/python tests/hostile_files.py --every 20   every twentieth
    .venv/bin/python tests/hostile_files.py --only curve.csv status

Commands run in processes that stay; one that hangs is killed and replaced.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parent
sys.path.insert(0, str(TESTS))
os.environ.setdefault("OMP_NUM_THREADS", "1")

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

Change = Callable[[Path], None]


@dataclass(frozen=True)
class Damage:
    """What is done to one file, and the commands that must name it."""

    path: str
    """Below the results folder."""
    name: str
    change: Change = field(compare=False)
    told: bool = True
    """Whether a command that reads the file must name it: some changes are harmless."""


# What can happen to any file.


def _replace(make: Callable[[Path], object]) -> Change:
    def change(path: Path) -> None:
        path.unlink()
        make(path)

    return change


def _content(make: Callable[[bytes], bytes]) -> Change:
    def change(path: Path) -> None:
        path.write_bytes(make(path.read_bytes()))

    return change


def _sparse(path: Path) -> None:
    with path.open("wb") as stream:
        stream.truncate(8 * 2**30)


def _socket(path: Path) -> None:
    os.mknod(path, 0o140644)


OF_ANY_FILE: Mapping[str, Change] = {
    "a folder": _replace(lambda path: path.mkdir()),
    "a pipe": _replace(lambda path: os.mkfifo(path)),
    "a socket": _replace(_socket),
    "a link to zeros without end": _replace(lambda path: path.symlink_to("/dev/zero")),
    "a link to random bytes without end": _replace(lambda path: path.symlink_to("/dev/urandom")),
    "a link to a terminal": _replace(lambda path: path.symlink_to("/dev/tty")),
    "a link to itself": _replace(lambda path: path.symlink_to(path.name)),
    "a link to nothing": _replace(lambda path: path.symlink_to("nowhere")),
    "a link to its folder": _replace(lambda path: path.symlink_to(".")),
    "eight gigabytes of nothing": _replace(_sparse),
    "empty": _content(lambda content: b""),
    "one line end": _content(lambda content: b"\n"),
    # Not at the end of a row: tables beside the cells have no checksum by which whole rows would be missed.
    "its first half": _content(lambda content: content[: len(content) // 2].rstrip(b"\n")),
    "without its last bytes": _content(lambda content: content[:-3]),
    "zeros of its length": _content(lambda content: bytes(len(content))),
    "zeros at its end": _content(lambda content: content + bytes(4096)),
    "zeros in its middle": _content(
        lambda content: content[: len(content) // 2] + bytes(8) + content[len(content) // 2 :]
    ),
    "bytes that are no text": _content(lambda content: b"\xff\xfe" + content),
    "random bytes": _content(lambda content: bytes(range(256)) * 64),
    "a line of two megabytes": _content(lambda content: b"x" * 2**21 + b"\n" + content),
    "thirty million commas": _content(lambda content: b"," * 12_000_000 + b"\n" + b"," * 3_000_000 + b"\n"),
    "a quote that never ends": _content(lambda content: b'"' + content),
    "a pickle": _content(
        lambda content: b"\x80\x04\x95\x1d\x00\x00\x00\x00\x00\x00\x00\x8c\x05posix\x94\x8c\x06system\x94."
    ),
}

# What can happen to a table.


def _lines(make: Callable[[list[str]], list[str]]) -> Change:
    def change(path: Path) -> None:
        path.write_text("".join(make(path.read_text().splitlines(keepends=True))))

    return change


def _field(row: int, column: str, value: str) -> Change:
    """Return a change of one field; `column` is the beginning of its name, `row` counts from 1."""

    def make(lines: list[str]) -> list[str]:
        header = lines[0].rstrip("\n").split(",")
        place = next(index for index, name in enumerate(header) if name.startswith(column))
        fields = lines[row].rstrip("\n").split(",")
        fields[place] = value
        return [*lines[:row], ",".join(fields) + "\n", *lines[row + 1 :]]

    return _lines(make)


def _without_column(column: str) -> Change:
    def make(lines: list[str]) -> list[str]:
        rows = [line.rstrip("\n").split(",") for line in lines]
        place = rows[0].index(column)
        return [",".join(fields[:place] + fields[place + 1 :]) + "\n" for fields in rows]

    return _lines(make)


def of_a_table(column: str) -> dict[str, Change]:
    """Return what can happen to a table with a column of numbers of this name."""
    values = {
        "not a number": "nan",
        "infinite": "inf",
        "minus infinite": "-inf",
        "a number beyond all": "1e308",
        "a number that is no double": "1e999",
        "an integer beyond all": "9" * 400,
        "text": "many",
        "nothing": "",
        "a date": "2026-01-01",
        "a formula": "=1+1",
        "true": "True",
        "a control sequence": "\x1b[2J",
        "a number with a comma": '"1,5"',
        "a hexadecimal number": "0x10",
    }
    return {
        **{f"{name} in '{column}'": _field(1, column, value) for name, value in values.items()},
        "a header alone": _lines(lambda lines: lines[:1]),
        "no header": _lines(lambda lines: lines[1:]),
        "its header twice": _lines(lambda lines: [lines[0], *lines]),
        "a row twice": _lines(lambda lines: [*lines, lines[-1]]),
        "a row less": _lines(lambda lines: lines[:-1]),
        "a row with a field more": _lines(lambda lines: [*lines[:-1], lines[-1].rstrip("\n") + ",1\n"]),
        "a row with a field less": _lines(lambda lines: [*lines[:-1], lines[-1].rpartition(",")[0] + "\n"]),
        "half a row at its end": _lines(lambda lines: [*lines[:-1], lines[-1][: len(lines[-1]) // 2]]),
        "an empty row": _lines(lambda lines: [*lines[:-1], "\n", lines[-1]]),
        "a byte order mark": _content(lambda content: b"\xef\xbb\xbf" + content),
        "UTF-16": _content(lambda content: content.decode().encode("utf-16")),
        "semicolons": _content(lambda content: content.replace(b",", b";")),
        f"without '{column}'": _without_column(column),
        f"'{column}' twice": _lines(
            lambda lines: [line.rstrip("\n") + f",{column if not n else 1}\n" for n, line in enumerate(lines)]
        ),
        "another table": _content(lambda content: b"somebody,else\n1,2\n"),
        "a page": _content(lambda content: b"<html><body>504 Gateway Time-out</body></html>\n"),
    }


# What can happen to a cell file.


def _json(make: Callable[[dict[str, Any]], object]) -> Change:
    def change(path: Path) -> None:
        values = json.loads(path.read_text())
        made = make(values)
        path.write_text(made if isinstance(made, str) else json.dumps(values if made is None else made))

    return change


def _set(*names: str, value: Any) -> Change:
    def make(values: dict[str, Any]) -> None:
        for name in names[:-1]:
            values = values.setdefault(name, {})
        values[names[-1]] = value

    return _json(make)


def _drop(name: str) -> Change:
    return _json(lambda values: {key: value for key, value in values.items() if key != name})


WRONG: Mapping[str, Any] = {
    "a list": [[]],
    "an object": {"a": {}},
    "null": None,
    "true": True,
    "a text": "\x1b[31mred",
    "minus one": -1,
    "a number beyond all": 10**30,
    "half": 0.5,
}
NEEDED = ("task", "method", "seed", "profile", "status", "env_steps", "config", "versions", "host", "timings", "schema")
INNER = (
    *(("code", name) for name in ("commit", "fingerprint", "changed")),
    *(("host", name) for name in ("name", "threads", "cores", "instruction_sets", "library_settings")),
    *(("timings", name) for name in ("started", "ended", "train_s", "evaluate_s")),
    *(("config", part) for part in ("run", "method")),
    ("config", "run", "steps", "source"),
    ("config", "run", "instances"),
)
"""Entries within entries."""
ALLOWED = {
    ("failure", "null"),
    ("label", "null"),
    ("label", "a text"),
    ("profile", "a text"),
    ("pid", "null"),
    ("code", "null"),
    ("code", "an object"),
    ("host", "an object"),
}
"""Entries and values that mean something or nothing."""


def of_a_cell_file() -> Iterator[tuple[str, Change, bool]]:
    """Yield name, change, and whether it is damage."""
    for entry in (*NEEDED, "label", "task_version", "failure", "axes", "pid", "code"):
        for name, value in WRONG.items():
            yield f"'{entry}' is {name}", _set(entry, value=value), (entry, name) not in ALLOWED
    for entry in NEEDED:
        yield f"without '{entry}'", _drop(entry), True
    for name, value in WRONG.items():
        if name != "minus one" and name != "half":
            yield (
                f"a time is {name}",
                _set("timings", "wall_s", value=value),
                name != "null" and name != "a number beyond all",
            )
        yield f"its budget is {name}", _set("config", "run", "steps", "value", value=value), True
        yield f"a version is {name}", _set("versions", "python", value=value), name not in ("null", "a text")
        yield f"its processor is {name}", _set("host", "cpu", value=value), name not in ("null", "a text")
    for names in INNER:
        for name, value in WRONG.items():
            yield f"'{'.'.join(names)}' is {name}", _set(*names, value=value), False
    widths = {"wide": [10**9, 10**9], "deep": [64] * 100_000, "of texts": ["64"], "of nothing": [], "negative": [-64]}
    for name, value in widths.items():
        yield f"networks {name}", _set("config", "method", "control_gnn", value={"value": value, "source": "x"}), False
    yield "a newer schema", _set("schema", value=99), True
    yield "an unknown status", _set("status", value="sleeping"), True
    yield "another seed", _set("seed", value=7), True
    yield "another task", _set("task", value="push"), True
    yield "another variant", _set("axes", value={"alpha": 0.5}), True
    yield "a key twice", _json(lambda values: json.dumps(values)[:-1] + ', "seed": 0}'), True
    yield "nested deeply", _json(lambda values: "[" * 200_000 + "]" * 200_000), True
    yield (
        "an integer of a million digits",
        _json(lambda values: json.dumps(values)[:-1] + f', "x": {"9" * 10**6}}}'),
        True,
    )
    yield "not a number", _set("env_steps", value=float("nan")), True
    yield "a time that is not a number", _set("timings", "wall_s", value=float("nan")), True
    yield "a list at the top", _json(lambda values: [values]), True
    yield "null at the top", _json(lambda values: "null"), True
    yield "a number at the top", _json(lambda values: "7"), True
    yield "a byte order mark", _content(lambda content: b"\xef\xbb\xbf" + content), True
    yield (
        "half a character in its label",
        _json(lambda values: json.dumps(values | {"label": "?"}).replace('"?"', '"\\udcff"')),
        True,
    )
    yield "a label of a megabyte", _set("label", value="x" * 10**6), True
    for name, label in LABELS.items():
        yield f"a label with {name}", _set("label", value=label), False


OF_SETTINGS: Mapping[str, Change] = {
    "no winners": _json(lambda values: {}),
    "winners that are a number": _json(lambda values: {"winners": 7}),
    "a winner that is a text": _json(lambda values: {"winners": ["x"]}),
    "a task that is a list": _json(lambda values: {"winners": [{**values["winners"][0], "task": []}]}),
    "settings that are numbers": _json(lambda values: {"winners": [{**values["winners"][0], "set": [1, 2]}]}),
    "settings that are null": _json(lambda values: {"winners": [{**values["winners"][0], "set": None}]}),
    "a key twice": _json(lambda values: '{"winners": [], "winners": []}'),
    "nested deeply": _json(lambda values: '{"winners": ' + "[" * 100_000 + "]" * 100_000 + "}"),
}
LABELS = {
    "control sequences": "\x1b]0;owned\x07\x1b[2J\x9b31m",
    "a formula": r"$\frac{1}{0$ and $\nonsense$",
    "dollars": "costs $5 or $6",
    "HTML": "<script>alert(1)</script><img src=x onerror=alert(1)>",
    "LaTeX": r"\input{/etc/passwd} 100% & #_{}~^",
    "a table's bars": "a | b \\| c",
    "line ends": "one\ntwo\r\nthree",
    "a reversed line": "\u202egnp.exe",
    "signs of other scripts": "方法 метод 🙂",
    "a link": "[x](javascript:alert(1)) ![y](http://example.com/z.png)",
    "markup of the console": "[bold red]x[/] [link=file:///]y[/link]",
}
CONTROLS = ("\x1b", "\x07", "\x9b", "\u202e", "\x00")
"""What no command may print."""


# What can happen to a policy.


def _safetensors(change: Callable[[dict[str, Any], bytes], tuple[dict[str, Any], bytes]]) -> Change:
    def on(path: Path) -> None:
        content = path.read_bytes()
        size = int.from_bytes(content[:8], "little")
        layout, data = change(json.loads(content[8 : 8 + size]), content[8 + size :])
        header = json.dumps(layout).encode()
        path.write_bytes(len(header).to_bytes(8, "little") + header + data)

    return on


def _with(name: str, value: Any) -> Change:
    """Return a change of an entry of the first array's description."""

    def change(layout: dict[str, Any], data: bytes) -> tuple[dict[str, Any], bytes]:
        first = next(key for key in layout if key != "__metadata__")
        layout[first][name] = value
        return layout, data

    return _safetensors(change)


def _of_numbers(make: Callable[[dict[str, Any]], dict[str, Any]]) -> Change:
    """Return a change of the arrays, with the checksum of what they become."""

    def change(path: Path) -> None:
        from codesign_bench.storage.arrays import load_arrays, save_arrays

        arrays, header = load_arrays(path)
        save_arrays(path, make(arrays), header)

    return change


def of_a_policy() -> dict[str, Change]:
    """Return what can happen to a file of arrays."""
    import numpy as np

    return {
        "a flipped bit": _content(lambda content: content[:-5] + bytes([content[-5] ^ 1]) + content[-4:]),
        "a header longer than the file": _content(lambda content: (2**40).to_bytes(8, "little") + content[8:]),
        "a header of no length": _content(lambda content: bytes(8) + content[8:]),
        "a header nested deeply": _content(
            lambda content: (400_000).to_bytes(8, "little") + b"[" * 200_000 + b"]" * 200_000
        ),
        "a shape beyond all": _with("shape", [2**40, 2**40]),
        "a negative shape": _with("shape", [-1, 5]),
        "offsets beyond its end": _with("data_offsets", [0, 2**50]),
        "negative offsets": _with("data_offsets", [-8, 8]),
        "offsets that are texts": _with("data_offsets", ["0", "8"]),
        "an unknown type": _with("dtype", "F1024"),
        "half precision": _with("dtype", "BF16"),
        "no description": _safetensors(
            lambda layout, data: ({key: value for key, value in layout.items() if key != "__metadata__"}, data)
        ),
        "no arrays": _of_numbers(lambda arrays: {}),
        "numbers that are none": _of_numbers(
            lambda arrays: {name: np.full_like(array, np.nan) for name, array in arrays.items()}
        ),
        "infinite numbers": _of_numbers(
            lambda arrays: {name: np.full_like(array, np.inf) for name, array in arrays.items()}
        ),
        "arrays of another shape": _of_numbers(lambda arrays: {name: np.zeros((3, 5), np.float32) for name in arrays}),
        "arrays of other names": _of_numbers(lambda arrays: {f"x{name}": array for name, array in arrays.items()}),
        "arrays of integers": _of_numbers(
            lambda arrays: {name: np.zeros(array.shape, np.int8) for name, array in arrays.items()}
        ),
    }


def _compressed(path: Path) -> None:
    """Put half a gigabyte of zeros into an archive of half a megabyte."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("buffer.npy", "w") as member:
        for _ in range(512):
            member.write(bytes(2**20))
    _take_checksums(path)


def _take_checksums(path: Path) -> None:
    """Give the checkpoint the checksums of its large file, as the author of a hostile one would."""
    from codesign_bench.storage.arrays import load_arrays, save_arrays

    with zipfile.ZipFile(path) as archive:
        checksums = {info.filename.removesuffix(".npy"): info.CRC for info in archive.infolist()}
    arrays, header = load_arrays(path.with_name("checkpoint.safetensors"))
    header["large"]["checksums"] = checksums
    save_arrays(path.with_name("checkpoint.safetensors"), arrays, header)


AROUND = ("zeros at its end", "bytes that are no text", "a line of two megabytes", "a quote that never ends")
"""What stands before or after the content; an archive and its checksums are the same with it."""
OF_LARGE_ARRAYS: Mapping[str, Change] = {
    "a bomb": _compressed,
    "missing": Path.unlink,
}


# The folder.

TABLES: Mapping[str, str] = {
    "reference_points.csv": "return_mean",
    "reference_points.instances.csv": "return",
    "design_sensitivity/toy_reach.csv": "outcome",
    "outside_region/toy_reach-toy_search.csv": "return",
    "cutout_regions/toy_reach-toy_search.csv": "return",
    "deployment/toy_reach/protocol.csv": "outcome",
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
    for name, change, told in of_a_cell_file():
        # The folder of one cell may be anywhere, and cells of version 0.1.0 have no such entry.
        moved = name.startswith(("another ", "'axes'"))
        yield Damage(f"{SEED}/cell.json", name, change, told), on_cells
        yield Damage(f"one/{CELL}/cell.json", name, change, told and not moved), CELL_COMMANDS
    for file, column in (("curve.csv", "return_mean"), ("evaluation.csv", "return")):
        for name, change in {**OF_ANY_FILE, **of_a_table(column), "missing": Path.unlink}.items():
            yield Damage(f"{SEED}/{file}", name, change), on_cells
    for name, change in OF_ANY_FILE.items():
        yield Damage(f"{SEED}/cell.json", name, change), on_cells
        yield Damage(f"one/{CELL}/cell.json", name, change), CELL_COMMANDS
        yield Damage(f"{SEED}/policy.safetensors", name, change), on_cells
        yield Damage(f"{SEED}/metrics.csv", name, change, told=False), on_cells
        yield Damage(f"{SEED}/output.log", name, _beside(change), told=False), on_cells
        yield Damage(f"one/{CELL}/policy.safetensors", name, change), CELL_COMMANDS
    for name, change in of_a_policy().items():
        yield Damage(f"one/{CELL}/policy.safetensors", name, change), CELL_COMMANDS
    for path, column in TABLES.items():
        for name, change in {**OF_ANY_FILE, **of_a_table(column)}.items():
            harmless = name == "a row less" and path in ("reference_points.csv",)
            yield Damage(path, name, change, told=not harmless), FOLDER_COMMANDS
    yield Damage(f"{SEED}/cell.json", "missing", Path.unlink), FOLDER_COMMANDS
    structural = {
        name: change for name, change in of_a_policy().items() if "arrays" not in name and "numbers" not in name
    }
    for name, change in {**OF_ANY_FILE, **structural}.items():
        yield Damage(f"{INTERRUPTED}/checkpoint.safetensors", name, change), (RESUME,)
    for name, change in {**OF_ANY_FILE, **OF_LARGE_ARRAYS}.items():
        yield Damage(f"{INTERRUPTED}/{LARGE}", name, change, told=name not in AROUND), (RESUME,)
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
    if damage.told and not (name in printed and (folder in printed or folder == "")):
        return f"did not name {damage.path}; exit code {code}; printed: {printed[-2000:]}"
    if command == "report" and damage.told and code == 0 and name not in (out / "report.html").read_text():
        return "the page does not name it"
    if any(control in printed for control in CONTROLS):
        return f"printed a control character: {printed!r}"
    if not damage.told and code == 2 and damage.name.startswith("a label with"):
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
            for number in numbers:
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
    told = [f"{command} {damage.path} {damage.name}" for damage, command in listed]
    numbers = [number for number, text in enumerate(told) if all(word in text for word in options.only)]
    numbers = numbers[options.first :: options.every]
    started = time.monotonic()
    wrong = campaign(numbers)
    print(f"{len(numbers) - len(wrong)} of {len(numbers)} combinations are right, {time.monotonic() - started:.0f} s")
    print(dict(Counter(line.split()[1] for line in wrong)))
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
