"""The study of all methods: it leaves none out, and searches the settings of each alike."""

from __future__ import annotations

from codesign_bench.registry import built_in
from codesign_bench.study import load_study, stages_of
from codesign_bench.tuning.settings import budgets_of, settings_of

STUDY = load_study("all_methods")


def test_every_method_meets_every_task_three_times() -> None:
    assert set(STUDY.methods) == set(built_in("methods"))
    assert set(STUDY.tasks) == set(built_in("tasks"))
    (cells,) = stages_of(list(STUDY.experiments.values()), "laptop")
    assert len(cells) == len(set(cells)) == len(STUDY.methods) * len(STUDY.tasks) * 3


def test_every_method_has_its_present_settings_and_three_changes_of_them_tried_on_every_task() -> None:
    tuning = STUDY.tuning
    assert tuning is not None
    for task in STUDY.tasks:
        for method in STUDY.methods:
            present, *changes = settings_of(tuning, task, method, "laptop")
            assert present.overrides == ()
            assert len(changes) == 3
            assert all(change.values for change in changes)
    assert budgets_of(tuning, "push", "laptop", None) == [250_000]
