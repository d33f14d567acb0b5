"""In what the methods and bases of a comparison differ besides being different: found, not listed.

A key counts when two pairs of method and basis both have it, with different values, and no pair has
it with several values: that would be an axis of the sweep, which every curve names.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mpmbench.results.bookkeeping import NOT_PART_OF_A_RUN
from mpmbench.settings.trees import dotted

# What changes no result besides: which runs there are, and when they are looked at.
NOT_CHOICES = {*NOT_PART_OF_A_RUN, "threads", "seed", "experiments", "cases", "snapshot_times"}
Pair = tuple[str, str]


@dataclass(frozen=True)
class Difference:
    """A choice that differs between pairs of method and basis.

    Attributes
    ----------
    key : str
        ``method.mass``.
    values : dict
        Its value by pair of method and basis, of those pairs that have it.
    """

    key: str
    values: dict[Pair, Any]

    def said(self, names: Mapping[str, str]) -> str:
        """``mass: lumped for mpm, consistent for otm and unified``; `names` of methods and bases."""
        groups: dict[str, list[Pair]] = {}
        for pair, value in self.values.items():
            groups.setdefault(str(value), []).append(pair)
        parts = []
        for value, pairs in groups.items():
            others = {pair[0] for other in groups if other != value for pair in groups[other]}
            subjects = dict.fromkeys(_subject(pair, others, names) for pair in pairs)
            *first, last = subjects
            those = f"{', '.join(first)} and {last}" if first else last
            parts.append(f"{value.replace('_', ' ')} for {those}")
        return f"{last_word(self.key)}: {', '.join(parts)}"

    @property
    def override(self) -> str:
        """What makes the pairs equal: the value that most of them have."""
        ((commonest, _),) = Counter(map(str, self.values.values())).most_common(1)
        return f"{self.key}={commonest}"


def _subject(pair: Pair, others: set[str], names: Mapping[str, str]) -> str:
    """A method, with its basis where that alone decides."""
    method, basis = (names.get(name, name.replace("_", " ")) for name in pair)
    return f"{method} {basis}" if pair[0] in others else method


def settings_of(config: dict[str, Any]) -> tuple[str, str, dict[str, Any]]:
    """Method, basis and settings of a configuration."""
    settings = {
        key: value
        for key, value in dotted(config).items()
        if key.partition(".")[0] not in NOT_CHOICES and not key.endswith(".name")
    }
    settings["material"] = config["material"]["name"]
    return config["method"]["name"], config["basis"]["name"], settings


def differences(runs: Iterable[tuple[str, str, Mapping[str, Any]]]) -> list[Difference]:
    """Choices in which pairs of method and basis differ, and none of which a pair varies.

    Parameters
    ----------
    runs : iterable of (method, basis, settings)
        Settings with keys joined by dots; None where a run has no such choice.
    """
    found: dict[str, dict[Pair, dict[str, Any]]] = {}
    for method, basis, settings in runs:
        for key, value in settings.items():
            if value is not None and key not in NOT_CHOICES:
                one = found.setdefault(key, {}).setdefault((method, basis), {})
                one[str(value)] = value
    return [
        Difference(key, {pair: next(iter(values.values())) for pair, values in pairs.items()})
        for key, pairs in sorted(found.items())
        if all(len(values) == 1 for values in pairs.values())
        and len({text for values in pairs.values() for text in values}) > 1
    ]


def sentences(found: Iterable[Difference], names: Mapping[str, str]) -> list[str]:
    """One for each difference, with the override that would make the pairs equal."""
    return [f"{one.said(names)} ({one.override} makes them equal)" for one in found]


def last_word(key: str) -> str:
    """``time step`` for ``time_step``, ``mass`` for ``method.mass``."""
    return key.rpartition(".")[2].replace("_", " ")
