"""All checks of a task, in the order in which they are asked."""

from __future__ import annotations

from collections.abc import Iterator

import codesign_bench.contract.task_declaration as task_declaration
import codesign_bench.contract.task_episodes as task_episodes
import codesign_bench.contract.task_instances as task_instances
import codesign_bench.contract.task_physics as task_physics
import codesign_bench.contract.task_rewards as task_rewards
import codesign_bench.contract.task_script as task_script
from codesign_bench.contract.check import Check, Verdict, ask, examine
from codesign_bench.task import Task, load_task

LOADS: Check[str] = task_declaration.loads
TASK_CHECKS: tuple[Check[Task], ...] = (
    task_declaration.spaces_fit,
    task_declaration.names_differ,
    task_episodes.episodes_end,
    task_episodes.observations_stay_in_bounds,
    task_episodes.states_stay_in_their_space,
    task_episodes.episodes_do_not_depend_on_others,
    task_episodes.designs_and_controls_matter,
    task_episodes.gymnasium_agrees,
    task_rewards.reward_is_the_sum_of_its_terms,
    task_rewards.success_is_what_is_declared,
    task_rewards.new_episodes_forget,
    task_instances.evaluation_instances_are_fixed,
    task_instances.validation_instances_are_others,
    task_instances.instances_follow_their_generator,
    task_instances.positions_have_a_region,
    task_instances.region_ends_with_the_instances,
    task_instances.training_leaves_the_cutout_out,
    task_instances.cutout_is_the_stated_share,
    task_instances.fine_tuning_is_outside_the_region,
    task_declaration.material_and_effort_are_fractions,
    task_declaration.tool_parts_follow_the_design,
    task_declaration.scene_has_sources,
    task_declaration.docstring_is_complete,
    task_script.script_is_a_function,
    task_script.script_solves_some,
    task_physics.looking_changes_nothing,
    task_physics.limits_are_kept,
    task_physics.physics_steps_are_short,
)
"""What is promised of every task that can be loaded."""


def examine_task(name: str) -> Iterator[Verdict]:
    """Yield the verdict of each check on the task of this name as soon as it is known.

    Raises:
        UserError: there is no such task.
        UnavailableError: this Python lacks what it needs.
    """
    verdict = ask(LOADS, name)
    yield verdict
    if not verdict.faults:
        task = load_task(name)
        yield from examine(TASK_CHECKS, task, type(task))
