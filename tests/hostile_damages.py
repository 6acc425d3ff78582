"""What can happen to the files of a results folder: damage, and what somebody may have written on purpose."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Change = Callable[[Path], None]


@dataclass(frozen=True)
class Damage:
    """What is done to one file, and the commands that must name it."""

    path: str
    """Below the results folder."""
    name: str
    change: Change = field(compare=False)
    named: bool = True
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
