"""Checks of what a task declares: its spaces, its docstring, its constants, its tools, material and effort.

Shapes: `b` batch, `D` design, `C` control.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import product

import numpy as np

from codesign_bench.contract.check import DoesWithoutError, Fault, counted, described, promised, undefined
from codesign_bench.errors import UnavailableError, UserError
from codesign_bench.task import Box, Floats, Task, load_task

SECTIONS = ("Action space", "Observation", "Goal space", "Reward", "Starting state", "Episode end")
SAMPLES = 4_000
TASK = "codesign_bench.task.Task"


def spaces(task: Task) -> dict[str, Box]:
    """Return the spaces that a task declares, by the names of the attributes."""
    return {name: getattr(task, name) for name in ("design_space", "control_space", "instance_space", "state_space")}


def corners(size: int) -> Floats:
    """Return corners (b, size) of [-1, 1]^size: all of them up to 12 entries, else as many drawn at random."""
    if size <= 12:
        return np.array(list(product((-1.0, 1.0), repeat=size)))
    return np.sign(np.random.default_rng(0).uniform(-1.0, 1.0, size=(2**12, size)))


@promised("It can be loaded, and everything that a task must define is there.", TASK, first=True)
def loads(name: str) -> Iterator[Fault]:
    """Yield what keeps the task of this name from being used.

    Raises:
        UnavailableError: this Python lacks what it needs.
    """
    try:
        task = load_task(name)
    except UnavailableError:
        raise
    except Exception as error:
        yield Fault(
            f"loading it raised {described(error, None)}", "one public subclass of Task, with every method of it"
        )
        return
    for attribute in undefined(type(task), Task):
        yield Fault(f"{type(task).__name__} has no `{attribute}`", "a value for every attribute that Task declares")
    if getattr(task, "name", name) != name:
        yield Fault(f"its name is '{task.name}'", f"'{name}', under which it is registered")


@promised("Its spaces are ranges that fit each other and its tool.", f"{TASK}.instance_space", first=True)
def spaces_fit(task: Task) -> Iterator[Fault]:
    """Yield what does not fit."""
    for name, box in spaces(task).items():
        for entry, low, high in zip(box.names, box.low, box.high, strict=True):
            if not (np.isfinite([low, high]).all() and low < high):
                yield Fault(f"{name}: {entry} ranges from {low} to {high}", "two finite ends, the lower one first")
    if not 0 <= task.goal_size <= task.instance_space.size:
        yield Fault(
            f"goal_size is {task.goal_size}, and an instance has {task.instance_space.size} entries",
            "the goal is the first entries of an instance",
        )
    nodes, graph = task.tool_graph.parameter_nodes, task.tool_graph
    if len(nodes) != task.design_space.size:
        yield Fault(
            f"tool_graph.parameter_nodes has {len(nodes)} entries, and a design {task.design_space.size}",
            "one node for each entry of a design",
        )
    if outside := sorted({*nodes, *(node for edge in graph.edges for node in edge)} - set(range(graph.num_nodes))):
        yield Fault(f"tool_graph names nodes {outside} of {graph.num_nodes}", f"nodes from 0 to {graph.num_nodes - 1}")
    for name, least in (("control_period", 1e-9), ("horizon", 1), ("num_evaluation_instances", 1), ("version", 1)):
        if not getattr(task, name) >= least:
            yield Fault(f"{name} is {getattr(task, name)}", "a positive number")


@promised("Every entry of an observation has a name of its own.", f"{TASK}.state_space")
def names_differ(task: Task) -> Iterator[Fault]:
    """Yield names that are used twice."""
    names = [*task.state_space.names, *task.goal_space.names, *task.design_space.names, *task.layout.PHASE_NAMES]
    for name, count in Counter(names).items():
        if count > 1:
            yield Fault(
                f"'{name}' names {count} entries", "different names for the entries of state, goal, design and phase"
            )


@promised("Its docstring has the sections that a reader looks for, and the sizes of its spaces.", TASK)
def docstring_is_complete(task: Task) -> Iterator[Fault]:
    """Yield sections and sizes that are missing."""
    text = " ".join(str(type(task).__doc__).split())
    if missing := [section for section in SECTIONS if f" {section} " not in text]:
        yield Fault(f"the docstring of {type(task).__name__} lacks: {', '.join(missing)}", "a section of each name")
    sizes = {
        "Design": task.design_space,
        "Control": task.control_space,
        "State": task.state_space,
        "Goal": task.goal_space,
    }
    if missing := [f"{part}, {space.size}: " for part, space in sizes.items() if f"{part}, {space.size}: " not in text]:
        yield Fault(
            f"the docstring of {type(task).__name__} lacks: {', '.join(repr(part) for part in missing)}",
            "the size of each space, and after it what its entries mean",
        )


@promised("Every number of its scene has a unit and a source.", f"{TASK}.scene")
def scene_has_sources(task: Task) -> Iterator[Fault]:
    """Yield constants without them."""
    if not task.scene:
        yield Fault("`scene` is empty", '`scene = constants(__name__)`, and numbers annotated with Given("m", OURS)')
    if bare := [name for name, constant in task.scene.items() if not (constant.unit and constant.source)]:
        yield Fault(f"no unit or no source: {counted(bare)}", "Given(unit, source) with both")


@promised("Material and effort are fractions: from 0 to 1, and 1 for the largest tool and control.", f"{TASK}.material")
def material_and_effort_are_fractions(task: Task) -> Iterator[Fault]:
    """Yield values outside of them, and maxima that are never reached."""
    rng = np.random.default_rng(4)
    inside = rng.uniform(-1.0, 1.0, size=(SAMPLES, task.design_space.size))
    material = task.material(task.design_space.from_unit(np.vstack([inside, corners(task.design_space.size)])))
    controls = rng.uniform(-1.0, 1.0, size=(SAMPLES, task.control_space.size))
    effort = task.effort(np.vstack([controls, corners(task.control_space.size)]))
    for name, used in (("material", material), ("effort", effort)):
        if not (used.min() >= 0.0 and np.isclose(used.max(), 1.0, rtol=1e-6)):
            yield Fault(f"`{name}` is from {used.min():.6g} to {used.max():.6g}", "from 0 or more to exactly 1")
    if material.min() >= 0.9:
        yield Fault(f"the smallest tool uses {material.min():.3g} of the most material", "less than 0.9")
    if (idle := task.effort(np.zeros((1, task.control_space.size)))[0]) >= 0.5:
        yield Fault(f"holding still takes {idle:.3g} of the largest effort", "less than 0.5")


@promised("A tool is made of one part for each node, which its design changes.", f"{TASK}.tool_parts")
def tool_parts_follow_the_design(task: Task) -> Iterator[Fault]:
    """Yield where they do not."""
    rng = np.random.default_rng(0)
    low, high = task.design_space.bounds
    try:
        first, second = (task.tool_parts(design) for design in task.design_space.sample(rng, 2))
    except UserError as error:
        raise DoesWithoutError("it does not define `tool_parts`") from error
    if {len(first), len(second)} != {task.tool_graph.num_nodes}:
        yield Fault(
            f"{len(first)} parts, and the tool graph has {task.tool_graph.num_nodes} nodes",
            "a part for each node, in their order",
        )
    if first == second:
        yield Fault("two random designs have the same parts", "parts that depend on the design")
    if task.tool_parts(0.5 * (low + high)) != task.tool_parts(0.5 * (low + high)):
        yield Fault("the same design has other parts in a second call", "the same parts")
    if len(kinds := {type(part).__name__ for part in first}) > 1:
        yield Fault(f"parts of several types: {', '.join(sorted(kinds))}", "parts of one type")
