"""`codesign-bench export`: write the tools of a policy as printable meshes, each with a data sheet.

Shapes: `I` instance, `D` design, `T` tools, `N` instances.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from codesign_bench import __version__
from codesign_bench.errors import UserError
from codesign_bench.fabrication.picture import picture
from codesign_bench.fabrication.printability import Print, judge
from codesign_bench.fabrication.solids import MILLIMETRES, handle_of, scaled, thickness, tool_solid
from codesign_bench.storage.files import Outputs, json_bytes, make_folder
from codesign_bench.storage.layout import rows_bytes
from codesign_bench.task import Behaviour, Box, Floats, Task
from codesign_bench.task.episodes import Episodes, portions
from codesign_bench.task.play import designed

if TYPE_CHECKING:
    from trimesh import Trimesh

ALL = "all"
SOLID_FORMATS = ("stl", "obj")
SHEET_FORMAT, PICTURE_FORMAT = "json", "png"
TABLE_FILE = "tools.csv"


@dataclass(frozen=True)
class Order:
    """The instances for which tools are written."""

    labels: tuple[str, ...]
    """A name for each instance."""
    instances: Floats
    """(N, I) in the instance space's units."""
    scale: float = 1.0
    """Scale of the prints relative to the tools."""

    @classmethod
    def of(
        cls,
        task: Task,
        start: str | None = None,
        goal: str | None = None,
        instances: str | None = None,
        scale: float = 1.0,
    ) -> Order:
        """Return the order for exactly one of `start`, `goal` and `instances`, in the form of the command line.

        Other entries of an instance are taken from the first evaluation instance.

        Raises:
            UserError: a value is invalid for the task.
        """
        if not (math.isfinite(scale) and scale > 0.0):
            raise UserError(f"--scale must be positive, not {scale}")
        fixed = task.evaluation_instances()
        if instances is not None:
            chosen = _numbers_of_instances(instances, len(fixed))
            return cls(tuple(f"instance-{number:03d}" for number in chosen), fixed[chosen], scale)
        names = task.goal_space.names
        option, text = ("--start", start) if start is not None else ("--goal", goal or "")
        if start is not None and not all("start" in name for name in names):
            raise UserError(f"--start: no object of task '{task.name}' has one; give --goal {','.join(names)}")
        values = _values(option, text, task.goal_space)
        return cls(
            (f"{option.lstrip('-')}-{'_'.join(f'{value:g}' for value in values)}",),
            np.concatenate([values, fixed[0, task.goal_size :]])[None],
            scale,
        )


def export(
    task: Task, policy: Behaviour, order: Order, out: Path, say: Callable[[str], None], source: str = ""
) -> list[Print]:
    """Write the tools of `policy` for the instances of `order` to `out`; return the properties of their prints.

    Every tool gets STL, OBJ, a JSON sheet and a picture; a tool that is the same for several instances is written once.
    A table has one row per tool.

    Args:
        task: the policy's task.
        policy: designs the tools.
        order: instances and scale.
        out: a folder; created if missing.
        say: prints a line.
        source: source of the policy, for the sheets.

    Raises:
        UserError: a file already exists or cannot be written, or the extra `export` is not installed; then no file is
            written.
    """
    designs, owners = np.unique(_designs(task, policy, order.instances), axis=0, return_inverse=True)
    first = [int(np.flatnonzero(owners == tool)[0]) for tool in range(len(designs))]
    stems = [f"{task.name}-{order.labels[index]}" for index in first]
    _open(out, [f"{stem}.{ending}" for stem in stems for ending in (*SOLID_FORMATS, SHEET_FORMAT, PICTURE_FORMAT)])
    prints, rows = [], []
    with Outputs(f"--out {out}") as outputs:
        for tool in np.argsort(first).tolist():
            served = np.flatnonzero(owners == tool).tolist()
            result = _write_tool(outputs, out / stems[tool], task, designs[tool], order, served, source)
            prints.append(result)
            rows.append(_row(stems[tool], order, served, result))
            say(_line(stems[tool], result))
        outputs.write(out / TABLE_FILE, rows_bytes(rows))
    say(f"{sum(result.printable for result in prints)} of {len(prints)} tools can be printed in one piece: {out}")
    return prints


def _write_tool(
    outputs: Outputs, stem: Path, task: Task, design: Floats, order: Order, served: list[int], source: str
) -> Print:
    """Write the files of one tool, which serves some instances of `order`; return the properties of its print."""
    solid = tool_solid(task, design, order.scale)
    walls = [thickness(scaled(part, order.scale)) for part in (*task.tool_parts(design), *handle_of(task))]
    result = judge(solid.mesh, MILLIMETRES * min(walls))
    for kind in SOLID_FORMATS:
        outputs.write(stem.with_name(f"{stem.name}.{kind}"), file_content(solid.mesh, kind))
    outputs.write(stem.with_name(f"{stem.name}.{PICTURE_FORMAT}"), picture(solid.mesh, stem.name))
    sheet = {
        "version": __version__,
        "task": task.name,
        "policy": source,
        "scale": order.scale,
        "instances": {order.labels[n]: _named(task.instance_space, order.instances[n]) for n in served},
        "design": _named(task.design_space, design),
        "units": dict(zip(task.design_space.names, task.design_space.units, strict=True)),
        "printable": result.printable,
        **asdict(result),
        "fillet_volume_mm3": solid.fillet_volume,
        "handle": "the gripper's, added" if handle_of(task) else "the tool's own first link",
    }
    outputs.write(stem.with_name(f"{stem.name}.{SHEET_FORMAT}"), json_bytes(sheet))
    return result


def file_content(mesh: Trimesh, kind: str) -> bytes:
    """Return `mesh` in one of `SOLID_FORMATS`."""
    content = mesh.export(file_type=kind)
    return content if isinstance(content, bytes) else str(content).encode()


def _designs(task: Task, policy: Behaviour, instances: Floats) -> Floats:
    """Return the designs (N, D) of `policy` for `instances` (N, I), in the design space's units."""
    parts = portions(len(instances), task)
    return np.concatenate([designed(Episodes(task, len(part)), policy, instances[part]) for part in parts])


def _open(out: Path, files: Iterable[str]) -> None:
    """Make the folder `out`; raise an error if one of `files` already exists."""
    make_folder(f"--out {out}", out)
    for name in (TABLE_FILE, *files):
        if (out / name).exists():
            raise UserError(f"--out {out}: {name} already exists; choose another folder")


def _numbers_of_instances(text: str, count: int) -> list[int]:
    if text == ALL:
        return list(range(count))
    try:
        chosen = list(dict.fromkeys(int(word) for word in text.split(",")))
    except ValueError:
        chosen = [-1]
    if any(not 0 <= number < count for number in chosen):
        raise UserError(f"--instances {text}: give numbers of evaluation instances, 0 to {count - 1}, or {ALL}")
    return chosen


def _values(option: str, text: str, space: Box) -> Floats:
    try:
        values = np.array([float(word) for word in text.split(",")])
    except ValueError:
        values = np.array([np.nan])
    if len(values) != space.size or not np.isfinite(values).all():
        entries = ", ".join(
            f"{name} ({low:g} to {high:g} {unit})"
            for name, low, high, unit in zip(space.names, space.low, space.high, space.units, strict=True)
        )
        raise UserError(f"{option} {text}: give a number for each of {entries}, separated by commas")
    return values


def _named(space: Box, values: Floats) -> dict[str, float]:
    return dict(zip(space.names, values.tolist(), strict=True))


def _row(stem: str, order: Order, served: list[int], result: Print) -> dict[str, Any]:
    return {
        "tool": stem,
        "instances": " ".join(order.labels[number] for number in served),
        "printable": int(result.printable),
        "volume_mm3": result.volume_mm3,
        "mass_kg": result.mass_kg,
        **{f"side_{axis}_mm": side for axis, side in zip("xyz", result.bounding_box_mm, strict=True)},
        "thinnest_wall_mm": result.thinnest_wall_mm,
        "problems": "; ".join(result.problems),
    }


def _line(stem: str, result: Print) -> str:
    sides = " x ".join(f"{side:.0f}" for side in result.bounding_box_mm)
    end = f"cannot be printed in one piece: {'; '.join(result.problems)}" if result.problems else "can be printed"
    return f"{stem}: {sides} mm, {1000.0 * result.mass_kg:.0f} g of solid PLA, {end}"
