"""Checks of a task's instances: fixed sets, the generator, the training region and the cutout."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import stats

from codesign_bench.cell.axes import FINE_TUNING_INSTANCES
from codesign_bench.contract.check import DoesWithoutError, Fault, promised
from codesign_bench.errors import UserError
from codesign_bench.method import Problem
from codesign_bench.task import Floats, Task, load_task

FRACTIONS = (0.2, 0.5, 0.8)
SAMPLES = 4_000
RARE = 1e-3
"""A difference that chance makes once in a thousand samples is reported as a fault."""
TASK = "codesign_bench.task.Task"


def outside(task: Task, instances: Floats) -> Iterator[Fault]:
    """Yield the first instance that is outside of the instance space."""
    beyond = np.argwhere(np.abs(task.instance_space.to_unit(instances)) > 1.0)
    for row, entry in beyond[:1]:
        space = task.instance_space
        yield Fault(
            f"instance {row} has {space.names[entry]} = {instances[row, entry]:g} {space.units[entry]}",
            f"from {space.low[entry]:g} to {space.high[entry]:g}, as `instance_space` says",
        )


@promised("Evaluation instances are fixed, different and inside the instance space.", f"{TASK}.evaluation_instances")
def evaluation_instances_are_fixed(task: Task) -> Iterator[Fault]:
    """Yield where they are not."""
    instances, expected = task.evaluation_instances(), (task.num_evaluation_instances, task.instance_space.size)
    if instances.shape != expected:
        yield Fault(f"an array of shape {instances.shape}", f"{expected}: num_evaluation_instances rows of instances")
        return
    if not np.array_equal(instances, load_task(task.name).evaluation_instances()):
        yield Fault("a second call gave other instances", "the same ones for everybody, from the generator it is given")
    if (count := len(np.unique(instances, axis=0))) < len(instances):
        yield Fault(f"{count} different instances among {len(instances)}", "no instance twice")
    yield from outside(task, instances)


@promised(
    "Validation instances are as many as evaluation instances, and none of them is one.", f"{TASK}.validation_instances"
)
def validation_instances_are_others(task: Task) -> Iterator[Fault]:
    """Yield where they are not."""
    validation, evaluation = task.validation_instances(), task.evaluation_instances()
    if validation.shape != evaluation.shape:
        yield Fault(f"an array of shape {validation.shape}", f"{evaluation.shape}, as evaluation instances")
        return
    if not np.array_equal(validation, load_task(task.name).validation_instances()):
        yield Fault("a second call gave other instances", "the same ones for everybody")
    together = np.concatenate([validation, evaluation])
    if (count := len(np.unique(together, axis=0))) < len(together):
        yield Fault(f"{len(together) - count} instances are in both sets, or twice in one", "no instance twice")
    yield from outside(task, validation)


@promised("Random instances depend on their generator alone.", f"{TASK}.sample_instances")
def instances_follow_their_generator(task: Task) -> Iterator[Fault]:
    """Yield where they do not."""
    first, again, other = (task.sample_instances(np.random.default_rng(seed), 8) for seed in (1, 1, 2))
    if first.shape != (8, task.instance_space.size):
        yield Fault(f"8 instances of shape {first.shape}", f"{(8, task.instance_space.size)}")
        return
    if not np.array_equal(first, again):
        yield Fault("the same seed gave other instances", "all randomness from the generator that is passed in")
    if np.array_equal(first, other):
        yield Fault("another seed gave the same instances", "instances that the generator draws")
    yield from outside(task, task.sample_instances(np.random.default_rng(3), SAMPLES))


@promised("It has a training region and a cutout if, and only if, it names a position.", f"{TASK}.position_entries")
def positions_have_a_region(task: Task) -> Iterator[Fault]:
    """Yield where it does not."""
    instances, entries = task.evaluation_instances(), task.position_entries
    if entries:
        if len(entries) > 2:
            yield Fault(f"position_entries has {len(entries)} names", "one or two, along x and y")
        if unknown := [name for name in entries if name not in task.instance_space.names]:
            yield Fault(f"position_entries names {unknown}", f"some of: {', '.join(task.instance_space.names)}")
            return
        inside = task.in_region(task.sample_instances(np.random.default_rng(1), SAMPLES))
        if not inside.all():
            yield Fault(f"{(~inside).sum()} of {SAMPLES} random instances are outside of `in_region`", "all inside")
        if task.in_cutout(instances, 0.0).any():
            yield Fault("a cutout of fraction 0 holds instances", "none")
        return
    for name, refused in (
        ("in_region", lambda: task.in_region(instances)),
        ("in_cutout", lambda: task.in_cutout(instances, 0.5)),
    ):
        try:
            refused()
        except UserError as error:
            if f"'{task.name}'" not in str(error):
                yield Fault(f"`{name}` is refused without the task's name: {error}", "a message that names the task")
        else:
            yield Fault(f"it has `{name}`, but no `position_entries`", "the names of the entries that are a position")


def of_positions(task: Task) -> None:
    """Go on only with a task that has a cutout.

    Raises:
        DoesWithoutError: it has none.
    """
    if not task.position_entries:
        raise DoesWithoutError("no goal or start is a position")


@promised("The training region ends where instances do.", f"{TASK}.in_region")
def region_ends_with_the_instances(task: Task) -> Iterator[Fault]:
    """Yield points beyond the instance space that count as inside."""
    of_positions(task)
    low, high = task.instance_space.bounds
    index, beyond = task.position_index, 1e-6 * (high - low)
    for corner in (high + beyond, low - beyond):
        point = 0.5 * (low + high)
        point[index] = corner[index]
        if task.in_region(point[None])[0]:
            place = ", ".join(f"{name} = {point[i]:g}" for name, i in zip(task.position_entries, index, strict=True))
            yield Fault(f"{place} is in the region", "no point beyond the instance space is")


@promised("Training with a cutout never sees it, and sees the rest as before.", f"{TASK}.in_cutout")
def training_leaves_the_cutout_out(task: Task) -> Iterator[Fault]:
    """Yield what training sees of it, and what changed elsewhere."""
    of_positions(task)
    everywhere = task.sample_instances(np.random.default_rng(1), SAMPLES)
    for fraction in FRACTIONS:
        excluded = task.in_cutout(everywhere, fraction)
        # Training draws again until nothing is in the cutout, which would never end with either of these faults.
        if not np.array_equal(excluded, task.in_cutout(everywhere, fraction)):
            yield Fault("a second call puts other instances in the cutout", "that it depends on the instance alone")
            return
        if excluded.all():
            yield Fault(f"a cutout of {fraction} holds every instance", f"about {fraction} of them")
            return
        kept = Problem(task, cutout=fraction).sample_instances(np.random.default_rng(2), SAMPLES)
        if task.in_cutout(kept, fraction).any():
            yield Fault(f"training draws instances inside a cutout of {fraction}", "none")
        allowed = everywhere[~excluded]
        for column, name in enumerate(task.instance_space.names):
            if stats.ks_2samp(kept[:, column], allowed[:, column]).pvalue <= RARE:
                yield Fault(f"with a cutout of {fraction}, {name} has another distribution outside of it", "the same")


@promised("The cutout is the stated share of the training region, and a larger one holds it.", f"{TASK}.in_cutout")
def cutout_is_the_stated_share(task: Task) -> Iterator[Fault]:
    """Yield shares that are others."""
    of_positions(task)
    instances = task.sample_instances(np.random.default_rng(3), SAMPLES)
    for fraction in FRACTIONS:
        excluded = task.in_cutout(instances, fraction)
        deviation = np.sqrt(fraction * (1.0 - fraction) / SAMPLES)
        if abs(excluded.mean() - fraction) > 4.0 * deviation:
            yield Fault(f"a cutout of {fraction} holds {excluded.mean():.3f} of random instances", f"{fraction}")
        if not (task.in_cutout(instances, min(1.0, fraction + 0.1)) >= excluded).all():
            yield Fault(f"a cutout of {fraction + 0.1:.1f} leaves out some of one of {fraction}", "all of it")


@promised(
    "Places of fine-tuning have several instances, all outside of the training region.",
    f"{TASK}.fine_tuning_instances",
)
def fine_tuning_is_outside_the_region(task: Task) -> Iterator[Fault]:
    """Yield where they do not."""
    if type(task).fine_tuning_instances is Task.fine_tuning_instances:
        raise DoesWithoutError("it has no fine-tuning instances")
    places, size = task.fine_tuning_instances(), task.instance_space.size
    if places.ndim != 3 or places.shape[1] < FINE_TUNING_INSTANCES or places.shape[2] != size:
        yield Fault(
            f"an array of shape {places.shape}", f"(places, {FINE_TUNING_INSTANCES} or more instances of each, {size})"
        )
        return
    if inside := int(task.in_region(places.reshape(-1, size)).sum()):
        yield Fault(f"{inside} instances are inside of the training region", "none")
