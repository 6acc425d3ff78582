"""Resolve a cell's configuration: defaults, profile, command line; the source of every value is recorded."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from codesign_bench.config.profiles import profile_named
from codesign_bench.config.run_settings import RunSettings
from codesign_bench.config.settings import METHOD, RUN, Settings, Sourced, StoredConfig, plain, sourced
from codesign_bench.config.validation import check_values, kinds_of, stored_values
from codesign_bench.config.values import parse_value, printable, shown
from codesign_bench.errors import UserError
from codesign_bench.method import Method
from codesign_bench.task import load_task

ABSENT = "absent"
"""Shown instead of a value if a configuration does not have the setting."""


@dataclass(frozen=True)
class ResolvedConfig:
    """The complete configuration of a cell."""

    run: RunSettings
    method: Any
    """An instance of the method's `config_class`."""
    sources: Mapping[str, str]
    """The source of each value; keys `run.<name>` and `method.<name>`."""

    def stored(self) -> StoredConfig:
        """Return the configuration in the form of a cell file."""
        parts = {RUN: self.run, METHOD: self.method}
        return StoredConfig(
            **{
                part: {
                    field.name: Sourced(plain(getattr(values, field.name)), self.sources[f"{part}.{field.name}"])
                    for field in fields(values)
                }
                for part, values in parts.items()
            }
        )


def resolve(
    method_class: type[Method[Any]],
    task_name: str,
    profile: str,
    overrides: Iterable[str] = (),
    steps: int | None = None,
    variant_overrides: Iterable[str] = (),
) -> ResolvedConfig:
    """Return the configuration of `method_class` on a task under `profile`.

    A value comes from the last of these that sets it: the class's default, the profile (its settings for all cells,
    then those of the task or the method for this profile, then its settings for this method), `--steps`, `--set`, and
    the variant.

    Args:
        method_class: the method.
        task_name: name of a task.
        profile: name of a profile.
        overrides: `key=value` or `prefix.key=value` with a method's name or `run` as prefix; keys of other methods are
            ignored.
        steps: the budget of `--steps`, or None for the profile's.
        variant_overrides: the overrides of the cell's variant, in the same form.

    Raises:
        UserError: an unknown task or profile, a value of the wrong type or out of range, or one that does not fit the
            task.
    """
    run, method = _of_profile(method_class, task_name, profile)
    if steps is not None:
        run["steps"] = Sourced(steps, "--steps")
    for source, override in [
        *(("--set", text) for text in overrides),
        *(("variant", text) for text in variant_overrides),
    ]:
        prefix, key, text = split_override(override)
        if prefix in (None, RUN) and key in run:
            run[key] = Sourced(_parse_field(RunSettings, key, text), source)
        elif prefix in (None, method_class.name) and key in method:
            method[key] = Sourced(_parse_field(method_class.config_class, key, text), source)
    config = _build(method_class.config_class, method)
    method_class.check(config, task_name)
    parts = {RUN: run, METHOD: method}
    return ResolvedConfig(
        run=_build(RunSettings, run),
        method=config,
        sources={f"{part}.{name}": entry.source for part, values in parts.items() for name, entry in values.items()},
    )


def check_overrides(overrides: Iterable[str], method_classes: Sequence[type[Method[Any]]]) -> None:
    """Check that every override sets a key of a selected method or a run setting.

    Raises:
        UserError: one does not; the message names it and the valid keys.
    """
    run_keys = [field.name for field in fields(RunSettings)]
    for override in overrides:
        prefix, key, _ = split_override(override)
        asked = [method for method in method_classes if prefix in (None, method.name)]
        known = [field.name for method in asked for field in fields(method.config_class)]
        known += run_keys if prefix in (None, RUN) else []
        if not known:
            choices = ", ".join([RUN, *(method.name for method in method_classes)])
            raise UserError(
                f"--set {printable(override)}: {shown(str(prefix))} is not a selected method; choose from: {choices}"
            )
        if key not in known:
            raise UserError(
                f"--set {printable(override)}: unknown key {shown(key)}; choose from: {', '.join(dict.fromkeys(known))}"
            )


def split_override(override: str) -> tuple[str | None, str, str]:
    """Split `prefix.key=value` into prefix (None if there is none), key and value.

    Raises:
        UserError: it has a different form.
    """
    name, equals, text = override.partition("=")
    prefix, dot, key = name.strip().rpartition(".")
    if not equals or not key:
        raise UserError(f"--set {printable(override)}: write it as key=value or method.key=value")
    return (prefix if dot else None), key, text.strip()


def method_config(config_class: type, stored: Settings) -> Any:
    """Rebuild a method's configuration from the `method` part of a `StoredConfig`.

    Raises:
        UserError: it is incompatible with the method's current configuration.
    """
    hints = kinds_of(config_class, limits=False)
    try:
        values = {name: _restore(hints[name], entry.value) for name, entry in stored.items()}
        with stored_values():
            return config_class(**values)
    except (KeyError, TypeError, ValueError) as error:
        raise UserError(f"stored configuration incompatible with {config_class.__qualname__}: {error}") from error


def differences(stored: StoredConfig, resolved: ResolvedConfig) -> list[str]:
    """Return "name: stored X, requested Y" for each value in which a stored and a resolved configuration differ.

    A name that is missing in the stored configuration did not exist at that time. It then has the class's default, so
    the default of a new hyperparameter must keep the previous behaviour.
    """
    found = []
    requested = resolved.stored()
    for part, values in ((RUN, resolved.run), (METHOD, resolved.method)):
        old, new, defaults = stored.parts[part], requested.parts[part], type(values)()
        for name in dict.fromkeys((*old, *new)):
            before = old[name].value if name in old else plain(getattr(defaults, name, ABSENT))
            after = new[name].value if name in new else ABSENT
            if before != after:
                found.append(f"{name}: stored {before}, requested {after}")
    return found


def _of_profile(
    method_class: type[Method[Any]], task_name: str, profile: str
) -> tuple[dict[str, Sourced], dict[str, Sourced]]:
    """Return the run settings and the method's, each with its source, of a profile without any overrides."""
    chosen, config_class = profile_named(profile), method_class.config_class
    of_task = sourced(load_task(task_name, plays=False).run_settings.get(profile, {}), f"tuned for {task_name} (ours)")
    of_method = {name: Sourced(*entry) for name, entry in method_class.profile(profile, task_name).items()}
    method = _start(config_class, {**of_method, **chosen.hyperparameters(method_class.name, task_name)})
    derived = method_class.derived(_build(config_class, method), profile, task_name)
    method |= {name: Sourced(*entry) for name, entry in derived.items()}
    return _start(RunSettings, {**chosen.run, **of_task}), method


def _start(config_class: type, profile: Settings) -> dict[str, Sourced]:
    """Return the defaults of a dataclass, overridden by a profile."""
    defaults = config_class()
    values = {
        field.name: Sourced(getattr(defaults, field.name), str(field.metadata.get("source", "default")))
        for field in fields(defaults)
    }
    for name, entry in profile.items():
        if name not in values:
            raise TypeError(f"a profile sets '{name}', which {config_class.__qualname__} does not have")
        values[name] = entry
    return values


def _build(config_class: type, values: Settings) -> Any:
    try:
        config = config_class(**{name: entry.value for name, entry in values.items()})
        check_values(config)
    except ValueError as error:
        raise UserError(f"bad configuration: {error}") from error
    return config


def _parse_field(config_class: type, name: str, text: str) -> Any:
    try:
        return parse_value(kinds_of(config_class)[name], text)
    except ValueError as error:
        raise UserError(f"--set {name}={printable(text)}: expected {error}") from error


def _restore(annotation: Any, value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_restore(None, item) for item in value)
    return float(value) if annotation is float and isinstance(value, int) else value
