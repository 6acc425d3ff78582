"""A study: experiments, figures and claims for one question, as data. The core knows only the default study's name.

A new study is one file in `codesign_bench/studies/`, or a module of another package, that defines `STUDY`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from codesign_bench.cell.axes import Axis
from codesign_bench.config.profiles import Profile
from codesign_bench.errors import unknown_name
from codesign_bench.registry import load_attribute, names
from codesign_bench.study.experiment import Experiment
from codesign_bench.study.tuning import Tuning

if TYPE_CHECKING:  # claims need pandas and scipy; listing studies does not
    from codesign_bench.claims.claim import Claim

DEFAULT_STUDY = "corl2023"
"""The default of `--study`; `--method all` and `--task all` select its methods and tasks."""
ALL = "all"


def no_claims() -> Sequence[Claim]:
    """Return no claims."""
    return ()


@dataclass(frozen=True, kw_only=True)
class Study:
    """Experiments, figures and claims for one question, with profiles and axes for them."""

    name: str
    """The study's name, which is also the name of its file."""
    title: str
    question: str
    """The question, in one or two sentences."""
    source: str = "ours"
    """A publication, or "ours"."""
    methods: tuple[str, ...] = ()
    """The methods compared, in the order of its tables."""
    tasks: tuple[str, ...] = ()
    """The tasks that it asks about, in the order of its figures; none: any task."""
    experiments: Mapping[str, Experiment] = field(default_factory=dict)
    """By name, cheap ones first."""
    claims: Callable[[], Sequence[Claim]] = no_claims
    """Returns its claims; called only when they are needed."""
    profiles: tuple[Profile, ...] = ()
    """Additional profiles."""
    axes: tuple[Axis, ...] = ()
    """Additional axes of its cells."""
    tuning: Tuning | None = None
    """How settings of its methods are searched; None: they are not."""

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of all figures of its experiments, without duplicates."""
        return tuple(dict.fromkeys(name for experiment in self.experiments.values() for name in experiment.figures))

    def experiments_named(self, wanted: Sequence[str]) -> dict[str, Experiment]:
        """Return experiments by their names or their figures' names; no names or `all` selects all.

        Raises:
            UserError: an unknown name.
        """
        known = {figure: name for name, experiment in self.experiments.items() for figure in experiment.figures}
        known |= {name: name for name in self.experiments}
        for name in wanted:
            if name not in known and name != ALL:
                choices = dict.fromkeys([*self.experiments, *self.figures])
                raise unknown_name("figure", name, (*choices, ALL, "or those of another --study"))
        if not wanted or ALL in wanted:
            return dict(self.experiments)
        return {known[name]: self.experiments[known[name]] for name in wanted}


def study_names() -> tuple[str, ...]:
    """Return the names of all studies, built-in and third-party."""
    return names("studies")


def load_study(name: str) -> Study:
    """Return the study `name`.

    Raises:
        UserError: an unknown study.
        TypeError: its module's `STUDY` is not a `Study`.
    """
    study = load_attribute("studies", name, "STUDY")
    if not isinstance(study, Study):
        raise TypeError(f"STUDY of the study '{name}' must be a Study, not {type(study).__name__}")
    return study
