"""Compositions that share their choice of options, which Hydra composes once.

Hydra takes 0.13 s for a composition, nearly all of it for the lists of defaults. Cells that differ in
values, in the method, the basis or the rule of contact need no other one: these sections are exchanged.
What is not simple is left to Hydra.
"""

import copy
from collections.abc import Callable, Sequence
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from mpmbench.settings import schema
from mpmbench.settings.files import read_yaml
from mpmbench.settings.resolve import fill
from mpmbench.settings.schema import GROUPS, BadInput, declared_anywhere, experiments, options
from mpmbench.settings.trees import dotted

EXCHANGED = ("basis", "contact", "method")  # a method comes after the basis that it may bring
Resolved = tuple[dict[str, Any], str]
Origin = tuple[set[str], str | None]  # keys that are set, and the name of the experiment


class Composer:
    """Composes many cells; `compose` is Hydra's composition of a list of overrides."""

    def __init__(self, compose: Callable[[list[str]], DictConfig]) -> None:
        self.compose = compose
        self.known: dict[tuple[Any, ...], tuple[dict[str, Any], Origin, bool]] = {}
        self.touched: set[tuple[Any, ...]] = set()  # where more than options fills sections
        self.parser = OverridesParser.create()

    def cell(self, overrides: Sequence[str], foreign_keys: bool = False) -> Resolved:
        """Plain configuration of a cell, and why it does not apply, if so.

        With `foreign_keys`, a key that the chosen option lacks and another one has makes it one
        that does not apply; otherwise that is an error.
        """
        return self.shared(overrides, foreign_keys) or resolved(self.compose(list(overrides)))

    def shared(self, overrides: Sequence[str], foreign_keys: bool = False) -> Resolved | None:
        """As `cell`, from what is known of its choice; None when Hydra itself has to be asked."""
        choices = [text for text in overrides if text.partition("=")[0] in (*GROUPS, "experiments")]
        values = [text for text in overrides if text not in choices]
        plain, origin, simple = self.composed(choices)
        if not simple or any(text.startswith("~") or "${" in text for text in values):
            return None
        config = copy.deepcopy(plain)
        for override in self.parser.parse_overrides(values):
            if not set_value(config, override, foreign_keys):
                return None
        given, experiment = origin
        return fill(config, given | {text.partition("=")[0] for text in values}, experiment)

    def composed(self, choices: list[str]) -> tuple[dict[str, Any], Origin, bool]:
        """What Hydra makes of a choice, as dictionaries, its origin, and whether these tell all."""
        sections = sections_of(choices)
        common = tuple(text for text in choices if text.partition("=")[0] not in sections)
        key: tuple[Any, ...] = (common, *sections)
        if key in self.touched:
            sections, key = {}, tuple(choices)
        if key not in self.known:
            whole = self.compose(choices)
            plain = as_dictionary(whole, resolve=False)
            if any(plain[group] != section for group, section in sections.items()):
                self.touched.add(key)
                sections, key = {}, tuple(choices)
            self.known[key] = plain, origin_of(whole), "${" not in str(plain)
        plain, origin, simple = self.known[key]
        return plain | sections, origin, simple


def sections_of(choices: Sequence[str]) -> dict[str, Any]:
    """The sections that chosen options fill whatever the others are, by their groups.

    An option that speaks of more than its section is left to Hydra, but for the basis that a method
    brings, which counts for nothing where another one is named.
    """
    named = dict(text.split("=", 1) for text in choices if "=" in text)
    found: dict[str, Any] = {}
    for group in EXCHANGED if len(named) == len(choices) else ():
        if named.get(group) in options(group):
            content = schema.composed(group, named[group])
            brought = content.get("defaults", [])
            of_basis = "basis" in found and all(set(one) == {"override /basis"} for one in brought)
            if set(content) <= {group, "defaults"} and (of_basis or not brought):
                found[group] = content[group]
    return found


def as_dictionary(composed: DictConfig, resolve: bool) -> dict[str, Any]:
    """What Hydra composed, without its own part."""
    task = OmegaConf.masked_copy(composed, [str(key) for key in composed if key != "hydra"])
    plain: Any = OmegaConf.to_container(task, resolve=resolve)
    return plain  # type: ignore[no-any-return]


def resolved(composed: DictConfig) -> Resolved:
    """Plain configuration of what Hydra composed, and why it does not apply, if so."""
    try:
        plain = as_dictionary(composed, resolve=True)
    except OmegaConfBaseException as error:
        raise BadInput(" ".join(str(error).split())) from None
    return fill(plain, *origin_of(composed))


def origin_of(composed: DictConfig) -> Origin:
    """Keys that command line and experiment set, for which the problem's defaults do not count."""
    experiment = composed.hydra.runtime.choices.get("experiments")
    known = experiments()
    body = read_yaml(known[experiment]) if experiment in known else {}
    before: Any = OmegaConf.to_container(composed.hydra.overrides.task, resolve=False)
    return {*(text.partition("=")[0] for text in before), *dotted(body)}, experiment


def set_value(config: dict[str, Any], override: Override, foreign_keys: bool) -> bool:
    """Set one value; False when the key is not there, or when the value is not a plain one."""
    *groups, name = override.key_or_group.split(".")
    target: Any = config
    for group in groups:
        target = target.get(group) if isinstance(target, dict) else None
    if override.is_sweep_override() or override.package is not None or not isinstance(target, dict):
        return False
    value = override.value()
    if isinstance(value, dict) or isinstance(target.get(name), dict):
        return False
    of_group = foreign_keys and groups and groups[0] in GROUPS
    if name not in target and not (of_group and name in declared_anywhere(groups[0])):
        return False
    target[name] = value
    return True
