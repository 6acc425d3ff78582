"""What holds for every study, built-in or not."""

from __future__ import annotations

import pytest

from codesign_bench.cell.cell import resolve_cells
from codesign_bench.config.profiles import profiles
from codesign_bench.errors import UserError
from codesign_bench.registry import load_module, names
from codesign_bench.study import DEFAULT_STUDY, load_study, stages_of, study_names

EVERY_STUDY = pytest.mark.parametrize("name", study_names())


@EVERY_STUDY
def test_a_study_is_named_like_its_file_and_says_what_it_asks(name: str) -> None:
    study = load_study(name)
    assert study.name == name
    assert study.title
    assert study.question.endswith("?")
    assert study.source


@EVERY_STUDY
def test_its_figures_methods_and_profiles_are_known(name: str) -> None:
    study = load_study(name)
    assert set(study.figures) <= set(names("paper_figs"))
    assert set(study.methods) <= set(names("methods"))
    for profile in study.profiles:
        assert profiles()[profile.name] is profile


@EVERY_STUDY
@pytest.mark.parametrize("profile", profiles())
def test_every_cell_of_its_experiments_can_be_resolved(name: str, profile: str) -> None:
    for stage in stages_of(list(load_study(name).experiments.values()), profile, seeds=1):
        if stage:
            assert all(resolved.config.run.steps >= 1 for resolved in resolve_cells(stage))


@EVERY_STUDY
def test_a_cell_that_starts_from_another_has_it_in_an_earlier_stage(name: str) -> None:
    for experiment in load_study(name).experiments.values():
        before: set[object] = set()
        for stage in stages_of([experiment], "laptop"):
            assert {cell.pretrained for cell in stage} - {None} <= before
            before |= set(stage)


@EVERY_STUDY
def test_claims_have_unique_names_known_tasks_and_commands_with_their_places(name: str) -> None:
    claims = load_study(name).claims()
    assert len({claim.name for claim in claims}) == len(claims)
    for claim in claims:
        assert set(claim.tasks) <= set(names("tasks"))
        assert claim.sentence
        assert claim.source
        assert claim.rule.needs
        assert all("{results}" in command for command in claim.rule.needs)


@EVERY_STUDY
def test_experiments_are_named_by_themselves_and_by_their_figures(name: str) -> None:
    study = load_study(name)
    assert study.experiments_named([]) == study.experiments_named(["all"]) == dict(study.experiments)
    for figure in study.figures:
        (experiment,) = study.experiments_named([figure]).values()
        assert figure in experiment.figures
    for wanted in (["figure_7"], ["all", "figure_7"]):
        with pytest.raises(
            UserError, match=r"unknown figure 'figure_7'; choose from: .*, all, or those of another --study"
        ):
            study.experiments_named(wanted)


def test_an_unknown_study_lists_the_studies() -> None:
    with pytest.raises(UserError, match=f"unknown study 'neurips'; choose from: .*{DEFAULT_STUDY}"):
        load_study("neurips")


@pytest.mark.parametrize("name", names("paper_figs"))
def test_every_figure_has_a_title_a_source_and_functions_of_a_frame(name: str) -> None:
    module = load_module("paper_figs", name)
    assert module.TITLE
    assert module.__doc__
    for function in ("SOURCE", "data", "draw"):
        assert callable(getattr(module, function))
    assert "codesign-bench" in getattr(module, "NEEDS", "codesign-bench")
