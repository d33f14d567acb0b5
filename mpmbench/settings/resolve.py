"""The plain, checked configuration of one run."""

import math
import re
from collections.abc import Callable, Container, Iterator
from typing import Any

from mpmbench.core.registry import names, plugin_files
from mpmbench.core.setting import did_you_mean
from mpmbench.settings.declarations import declaration
from mpmbench.settings.schema import (
    GROUPS,
    INSTANTS,
    MOST_INSTANTS,
    NO_TEXT,
    PROBLEM_DEFAULTS,
    TOP_LEVEL,
    BadInput,
    declared,
    declared_anywhere,
    unknown_key,
)

# A number with a unit behind it, such as 2kPa or 30%.
WITH_UNIT = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)? ?[^\W\d_][\w/^*.-]*|[-+]?\d+\.?\d* ?%", re.IGNORECASE
)
# In SI units nothing is larger or smaller; beyond, products of settings overflow.
SMALLEST, LARGEST = 1e-60, 1e60
MOST_STEPS = 2.0**53


def fill(
    plain: dict[str, Any], given: set[str], experiment: str | None
) -> tuple[dict[str, Any], str]:
    """Apply the problem's ``method_defaults``, ``basis_defaults`` and ``material_defaults``, then check types.

    Those of methods and bases are listed by name; a key that was given keeps its value.
    """
    config = {
        key: dict(value) if key in GROUPS else value
        for key, value in plain.items()
        if key != "cases"
    }
    by_method, by_basis, for_material = (
        config["problem"].pop(key, None) or {} for key in PROBLEM_DEFAULTS
    )
    for group, defaults in (
        ("method", by_method.get(config["method"]["name"], {})),
        ("basis", by_basis.get(config["basis"]["name"], {})),
        ("material", for_material),
    ):
        for key, value in defaults.items():
            if key in config[group] and f"{group}.{key}" not in given:
                config[group][key] = value
    config.pop("experiments", None)
    if config.get("campaign") is None:
        config["campaign"] = experiment or "default"
    short = {key: cast_to(cast, key, config.pop(key, None)) for key, cast in INSTANTS.items()}
    checked, reason = check_types(config, given)
    end_time = checked["end_time"]
    added = instants(end_time, **short)
    checked["snapshot_times"] = sorted({*checked["snapshot_times"], *added})
    for instant in checked["snapshot_times"]:
        if instant > end_time * (1.0 + 1e-12):
            raise BadInput(f"snapshot_times = {instant:g}: it comes after end_time = {end_time:g}")
    return checked, reason


def instants(
    end_time: float, snapshots: int | None, snapshot_every: float | None
) -> Iterator[float]:
    """Instants [s] between the start and the end, in so many equal parts, and so far apart.

    Raises `BadInput` when they are further apart than the end, or more than can be kept.
    """
    yield from (end_time * k / snapshots for k in range(1, snapshots or 0) if snapshots)
    if snapshot_every is None:
        return
    if snapshot_every > end_time:
        raise BadInput(
            f"snapshot_every = {snapshot_every:g}: it is more than end_time = {end_time:g}"
        )
    number = math.ceil(end_time / snapshot_every * (1.0 - 1e-12))
    if number > MOST_INSTANTS:
        raise BadInput(
            f"snapshot_every = {snapshot_every:g} with end_time = {end_time:g}: these are {number} "
            f"instants, and at most {MOST_INSTANTS} can be kept"
        )
    yield from (snapshot_every * k for k in range(1, number))


def cast_to(cast: Callable[[Any], Any], key: str, value: Any) -> Any:
    """A value as its setting casts it; raises `BadInput` with the key for one that does not fit."""
    try:
        found = cast(value)
    except ValueError as error:
        shown, hint = "null" if value is None else value, ""
        if isinstance(value, str) and NO_TEXT.fullmatch(value):
            of_variable = "${oc.decode:${oc.env:NAME}} where it comes from ${oc.env:NAME}"
            shown, hint = f"'{value}'", f", no text in quotes; write {of_variable}"
        raise BadInput(f"{key} = {shown}: {error}{hint}") from None
    for number in found if isinstance(found, list) else [found]:
        if isinstance(number, float) and number and not SMALLEST <= abs(number) <= LARGEST:
            raise BadInput(f"{key} = {value}: a size from {SMALLEST:g} to {LARGEST:g} is needed")
    return found


def refuse_unit(key: str, value: Any, unit: str) -> None:
    """Raise `BadInput` with the unit that is meant for a number with one, as in ``2kPa``."""
    written = WITH_UNIT.fullmatch(value) if isinstance(value, str) and unit else None
    if written:
        meant = "a pure number" if unit == "-" else f"a number in {unit}"
        raise BadInput(f"{key} = {value}: {meant} is needed, without a unit behind it")


def check_range(config: dict[str, Any]) -> None:
    """Raise `BadInput` when there are more time steps than can be counted in a float."""
    step, end_time = config["time_step"], config["end_time"]
    if step != "auto" and end_time / step > MOST_STEPS:
        raise BadInput(
            f"end_time = {end_time:g} with time_step = {step:g}: these are {end_time / step:.1g} time "
            f"steps, and at most {MOST_STEPS:.1g} can be counted"
        )


def check_loop(config: dict[str, Any]) -> None:
    """Raise `BadInput` when the time loop of a method is none that is known here."""
    name = str(config["method"].get("time"))
    if name == "None" or (re.fullmatch(r"\w+", name) and plugin_files()):
        return  # what a plug-in registers is known when it is imported
    known = names("method")
    if name in known:
        return
    hint = did_you_mean(name, known) or f"; there are {', '.join(known)}"
    raise BadInput(f"method.time = {name}: there is no such time loop{hint}")


def check_types(config: dict[str, Any], given: Container[str] = ()) -> tuple[dict[str, Any], str]:
    """The configuration with every value cast to its declared type, and why it does not apply, if so.

    It does not apply when a key was given that another option of the group has, but not the chosen
    one. Keys of the method that its time loop does not have are left out, unless they are `given`.

    Raises
    ------
    BadInput
        For a key that does not exist or a value of another type or, at the top level, range.
    """
    checked: dict[str, Any] = {}
    check_loop(config)
    for key, cast in TOP_LEVEL.items():
        group, _, name = key.rpartition(".")
        value = (config.get(group) or {}).get(name) if group else config.get(name)
        if value is None and key in ("resolution", "time_step", "end_time", "particles_per_cell"):
            raise BadInput(
                f"{key}: problem={config['problem']['name']} has no default for it, so give a value"
            )
        target = checked.setdefault(group, {}) if group else checked
        target[name] = cast_to(cast, key, value)
    for key in config:
        if key not in {*TOP_LEVEL, *GROUPS, "limits"}:
            raise unknown_key(key)
    reason = ""
    loop = declaration("method", str(config["method"].get("time"))).settings
    for group in GROUPS:
        option = config[group]["name"]
        defaults = declared(group, option)
        checked[group] = dict(config[group])
        for name, value in config[group].items():
            if name == "name":
                continue
            if group == "method" and loop and name in defaults and name not in loop:
                if f"method.{name}" in given:
                    reason = reason or f"method.time={config[group]['time']} has no {name}"
                del checked[group][name]
                continue
            if name in defaults:
                refuse_unit(f"{group}.{name}", value, defaults[name].unit)
                checked[group][name] = cast_to(defaults[name].cast, f"{group}.{name}", value)
            elif name in declared_anywhere(group):
                reason = reason or f"{group}={option} has no {name}"
            else:
                raise unknown_key(f"{group}.{name}")
    check_range(checked)
    return checked, reason
