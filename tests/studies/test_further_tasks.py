"""The study of the tasks beyond the paper's: its cells, and that neither the paper's study nor its group has them."""

from __future__ import annotations

from codesign_bench.cli.arguments import ALL, BEYOND, groups
from codesign_bench.registry import built_in
from codesign_bench.study import DEFAULT_STUDY, load_study, stages_of

STUDY = load_study("further_tasks")


def test_every_method_of_the_paper_meets_every_task_beyond_it_six_times() -> None:
    (cells,) = stages_of(list(STUDY.experiments.values()), "laptop")
    assert len(cells) == len(set(cells)) == 5 * len(STUDY.tasks) * 6
    assert STUDY.methods == load_study(DEFAULT_STUDY).methods


def test_its_tasks_are_all_that_the_papers_study_lacks() -> None:
    paper = load_study(DEFAULT_STUDY)
    assert {*paper.tasks, *STUDY.tasks} == set(built_in("tasks"))
    assert not set(paper.tasks) & set(STUDY.tasks)


def test_no_experiment_and_no_claim_of_the_papers_study_is_about_them() -> None:
    paper = load_study(DEFAULT_STUDY)
    cells = [cell for stage in stages_of(list(paper.experiments.values()), "laptop") for cell in stage]
    assert not {cell.task for cell in cells} & set(STUDY.tasks)
    assert not {task for claim in paper.claims() for task in claim.tasks} & set(STUDY.tasks)


def test_all_is_the_papers_tasks_and_beyond_the_others() -> None:
    found = groups("tasks")
    assert found[ALL] == load_study(DEFAULT_STUDY).tasks
    assert set(STUDY.tasks) <= set(found[BEYOND])
