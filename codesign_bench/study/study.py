"""A study: all that a question needs, as data. The benchmark itself knows no study but the default one's name.

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

if TYPE_CHECKING:  # claims need pandas and scipy, which listing a study does not
    from codesign_bench.claims.claim import Claim

DEFAULT_STUDY = "corl2023"
"""The study of `reproduce`, `verify`, `report` and `plot` without `--study`, whose methods `--method all` means."""
ALL = "all"


def no_claims() -> Sequence[Claim]:
    """Return no claim."""
    return ()


@dataclass(frozen=True, kw_only=True)
class Study:
    """Experiments, figures and claims that belong together, and what of a profile they set."""

    name: str
    """Its file's name."""
    title: str
    question: str
    """What it asks, in a sentence or two."""
    source: str = "ours"
    """A publication, or "ours"."""
    methods: tuple[str, ...] = ()
    """The methods that it compares, in the order of its tables."""
    experiments: Mapping[str, Experiment] = field(default_factory=dict)
    """By name, cheap ones first."""
    claims: Callable[[], Sequence[Claim]] = no_claims
    """Makes its claims when they are asked for."""
    profiles: tuple[Profile, ...] = ()
    """Profiles that it adds."""
    axes: tuple[Axis, ...] = ()
    """Axes that its cells vary beyond the built-in ones."""
    tuning: Tuning | None = None
    """How settings of its methods are searched; None: they are not."""

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of all figures of its experiments, each once."""
        return tuple(dict.fromkeys(name for experiment in self.experiments.values() for name in experiment.figures))

    def experiments_named(self, wanted: Sequence[str]) -> dict[str, Experiment]:
        """Return the experiments that names mean: their own or those of figures; none or `all` means every one.

        Raises:
            UserError: an unknown name.
        """
        if not wanted or ALL in wanted:
            return dict(self.experiments)
        known = {figure: name for name, experiment in self.experiments.items() for figure in experiment.figures}
        known |= {name: name for name in self.experiments}
        for name in wanted:
            if name not in known:
                raise unknown_name("experiment", name, (*dict.fromkeys([*self.experiments, *self.figures]), ALL))
        return {known[name]: self.experiments[known[name]] for name in wanted}


def study_names() -> tuple[str, ...]:
    """Return the names of all studies, built-in and third-party."""
    return names("studies")


def load_study(name: str) -> Study:
    """Return the study `name`.

    Raises:
        UserError: there is no such study.
        TypeError: its module's `STUDY` is something else.
    """
    study = load_attribute("studies", name, "STUDY")
    if not isinstance(study, Study):
        raise TypeError(f"STUDY of the study '{name}' must be a Study, not {type(study).__name__}")
    return study
