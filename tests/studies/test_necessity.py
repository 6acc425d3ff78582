"""The study of what is needed: pairs of methods on all tasks, on seeds that no tuning has seen."""

from __future__ import annotations

import pytest

from codesign_bench.cell.cell import resolve_cell
from codesign_bench.method import load_method
from codesign_bench.studies.necessity import QUESTIONS, Question
from codesign_bench.study import FIRST_REPORTED_SEED, load_study, stages_of

STUDY = load_study("necessity")
(CELLS,) = stages_of(list(STUDY.experiments.values()), "laptop")


def test_every_method_runs_on_every_task_with_three_seeds_at_least() -> None:
    seeds: dict[tuple[str, str], set[int]] = {(cell.task, cell.method): set() for cell in CELLS}
    for cell in CELLS:
        seeds[cell.task, cell.method].add(cell.seed)
    assert {method for _, method in seeds} == set(STUDY.methods)
    assert len({task for task, _ in seeds}) == 6
    assert len(seeds) == 6 * len(STUDY.methods)
    assert min(map(len, seeds.values())) == 3
    assert min(cell.seed for cell in CELLS) >= FIRST_REPORTED_SEED


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question.name)
def test_both_sides_of_a_question_have_the_same_budget_on_every_task(question: Question) -> None:
    steps: dict[str, set[int]] = {}
    for cell in CELLS:
        if cell.method in (question.with_it, question.without):
            steps.setdefault(cell.task, set()).add(resolve_cell(cell).config.run.steps)
    assert len(steps) == 6
    assert {len(budgets) for budgets in steps.values()} == {1}


@pytest.mark.parametrize("name", ["tool_per_goal.search", "tool_per_goal.plans"])
def test_whether_a_tool_per_goal_is_needed_is_asked_of_methods_that_differ_in_it(name: str) -> None:
    (question,) = (question for question in QUESTIONS if question.name == name)
    assert load_method(question.with_it).tool_per_goal
    assert not load_method(question.without).tool_per_goal


def test_every_question_is_asked_across_tasks_and_on_each() -> None:
    names = [claim.name for claim in STUDY.claims()]
    assert len(names) == len(set(names)) == len(QUESTIONS) * (1 + 6)
    assert all(claim.rule.needs == STUDY.claims()[0].rule.needs for claim in STUDY.claims())
