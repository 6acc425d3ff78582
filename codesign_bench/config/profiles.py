"""Profiles: named sets of settings, in order of increasing cost. A study may define more."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from codesign_bench.config.settings import Settings, sourced
from codesign_bench.errors import unknown_name
from codesign_bench.registry import load_all

DEFAULT_PROFILE = "laptop"

Hyperparameters = Callable[[str, str], Settings]
"""Maps the names of a method and a task to the hyperparameters that a profile sets for them."""


def no_hyperparameters(method_name: str, task_name: str) -> Settings:
    """Return no settings, for every method and task."""
    return {}


@dataclass(frozen=True)
class Profile:
    """Settings for one purpose: how long cells train, and with which hyperparameters.

    Methods and tasks add their own settings under the profile's name: see `Method.profile` and `Task.run_settings`.
    """

    name: str
    help: str
    """Its purpose, in one line."""
    run: Settings = field(default_factory=dict)
    """Run settings for every task."""
    hyperparameters: Hyperparameters = no_hyperparameters
    """Hyperparameters; they override those of `Method.profile`."""
    most_seeds: int | None = None
    """Largest number of seeds in experiments; None: the study's number."""


BUILT_IN: Mapping[str, Profile] = {
    profile.name: profile
    for profile in (
        Profile(
            "quick",
            "minutes on two cores: the same code, for a first look",
            sourced({"steps": 180_000, "evaluations": 9}, "ours"),
            most_seeds=1,
        ),
        Profile(
            "laptop",
            "an hour or two per 2D task on two cores (default)",
            sourced({"steps": 1_000_000, "evaluations": 20}, "ours"),
        ),
        Profile(
            "workstation",
            "meant for conclusions: the settings of `laptop`, and longer budgets (docs/budgets.md)",
            sourced({"steps": 3_000_000, "evaluations": 30}, "ours"),
        ),
    )
}


def profiles() -> dict[str, Profile]:
    """Return all profiles by name: the built-in ones, then those of every study."""
    added = (profile for _, study in load_all("studies", "STUDY") for profile in study.profiles)
    return {**BUILT_IN, **{profile.name: profile for profile in added}}


def profile_named(name: str) -> Profile:
    """Return the profile `name`.

    Raises:
        UserError: there is no such profile.
    """
    if name in BUILT_IN:  # without importing a study
        return BUILT_IN[name]
    known = profiles()
    if name not in known:
        raise unknown_name("profile", name, known)
    return known[name]
