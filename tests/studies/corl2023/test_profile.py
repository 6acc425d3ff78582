"""The profile `paper` holds what the paper's tables print."""

from __future__ import annotations

from dataclasses import fields

import pytest

from codesign_bench.config.resolve import resolve
from codesign_bench.learning.cma_es import EvolutionConfig
from codesign_bench.method import load_method
from codesign_bench.studies.corl2023.learners import CMA_ES_SWEEP, LEARNERS
from codesign_bench.studies.corl2023.profile import evolution, hyperparameters


def test_the_settings_of_cma_es_are_those_in_bold() -> None:
    settings = evolution("push")
    assert settings.keys() == {field.name for field in fields(EvolutionConfig)}
    assert settings["popsize"].value == CMA_ES_SWEEP.population_size.best
    assert all("paper" in source for _, source in settings.values())


@pytest.mark.parametrize("task_name", LEARNERS)
def test_the_papers_own_method_has_every_row_of_its_table(task_name: str) -> None:
    config = resolve(load_method("gnn_ppo"), task_name, "paper")
    for field in fields(LEARNERS[task_name]):
        assert getattr(config.method, field.name) == getattr(LEARNERS[task_name], field.name)
        assert config.sources[f"method.{field.name}"] == f"paper, table of {task_name}"
    assert (config.run.steps, config.method.design_credit) == (10_000_000, "joint")
    assert config.method.batch_design
    assert config.sources["method.batch_design"].startswith("Transform2Act's hopper and gap configurations")


def test_a_task_that_the_paper_does_not_have_gets_the_settings_of_push() -> None:
    of_push, of_other = (hyperparameters("gnn_ppo", name) for name in ("push", "bounce"))
    assert {name: value for name, (value, _) in of_push.items()} == {
        name: value for name, (value, _) in of_other.items()
    }
    assert of_other["batch_size"].source == "paper, table of push (no table for this task)"


def test_a_method_that_the_paper_does_not_have_gets_nothing() -> None:
    assert hyperparameters("pt_me", "push") == {}
