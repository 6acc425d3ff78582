"""Values of settings with their sources, and their form on disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

RUN, METHOD = "run", "method"
"""The two parts of a configuration: the runner's settings and the method's hyperparameters."""


class Sourced(NamedTuple):
    """A value and its source."""

    value: Any
    source: str
    """Origin of the value: a table of a paper, "ours", a profile, or an option of the command line."""


Settings: TypeAlias = Mapping[str, Sourced]
"""Name of a setting -> value and source."""


def sourced(values: Mapping[str, Any], source: str) -> dict[str, Sourced]:
    """Give every value the same source."""
    return {name: Sourced(value, source) for name, value in values.items()}


@dataclass(frozen=True)
class StoredConfig:
    """A configuration in the form of a cell file: plain JSON values, each with its source."""

    run: Settings = field(default_factory=dict)
    method: Settings = field(default_factory=dict)

    @property
    def parts(self) -> dict[str, Settings]:
        """Both parts by name."""
        return {RUN: self.run, METHOD: self.method}

    def to_json(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Return part -> name -> {"value", "source"}."""
        return {
            part: {name: entry._asdict() for name, entry in settings.items()} for part, settings in self.parts.items()
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> StoredConfig:
        """Return the configuration that `to_json` wrote.

        Raises:
            KeyError, TypeError, AttributeError: `content` has a different form.
        """
        return cls(
            **{
                part: {name: Sourced(entry["value"], str(entry["source"])) for name, entry in content[part].items()}
                for part in (RUN, METHOD)
            }
        )


def plain(value: Any) -> Any:
    """Return the JSON form of a value: tuples become lists, so that stored and resolved values compare."""
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value
