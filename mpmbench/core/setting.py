"""A setting is declared once, in the line of its field: default, sentence, unit and range.

``d_max: float = setting(2.0, "radius of a support", unit="-", above=1.0, most=10.0)`` stands in a
dataclass that derives from `Settings`. The arguments are literals, since the command line reads them
from the text of the file, without importing it.
"""

import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any

from mpmbench.core.errors import BadSetting


@dataclass(frozen=True)
class Setting:
    """What may be given for one key.

    Parameters
    ----------
    default : object
        Also says the type: 4000.0 is any number, 3 a whole one, None a number or null; else a bool,
        a word, or a list of such.
    says : str
        What the key means, in a few words.
    unit : str
        "Pa", or "-" where a number has none; empty for what is no number.
    options : tuple, optional
        The only values.
    least, most : float, optional
        Limits that are allowed themselves.
    above, below : float, optional
        Limits that are not.
    by_preset : bool
        It is a key of a method only where the preset gives it.
    """

    default: Any
    says: str
    unit: str = ""
    options: tuple[Any, ...] | None = None
    least: float | None = None
    most: float | None = None
    above: float | None = None
    below: float | None = None
    by_preset: bool = False

    @property
    def allowed(self) -> str:
        """The values that are accepted, in words, for example ``a number greater than 1``."""
        if self.options is not None:
            return "one of " + ", ".join(map(str, self.options))
        kind = next(words for types, words in KINDS if isinstance(self.default, types))
        if self.limits:
            kind = f"{kind.replace('finite ', '')} {self.limits}"
        return f"{kind}, or null," if self.default is None else kind

    @property
    def limits(self) -> str:
        """The range in words, for example ``from 0 to less than 1``; empty where there is none."""
        lower, upper = (
            next((name for name in names if getattr(self, name) is not None), None)
            for names in (("above", "least"), ("below", "most"))
        )
        return LIMITS[lower, upper].format(**vars(self))

    def needed(self, value: Any) -> str:
        """What is needed instead of a value: a finite number, or what is allowed."""
        infinite = isinstance(value, float) and math.isinf(value)
        return "a finite number" if infinite and self.options is None else self.allowed

    def hint(self, value: Any) -> str:
        """``; did you mean ...?`` when an option is similar to what was given."""
        return did_you_mean(str(value), map(str, self.options or ()))

    def cast(self, value: Any) -> Any:
        """The value as the type of the default.

        Raises
        ------
        ValueError
            With what is needed, for another type or a value out of range.
        """
        if value is None and self.default is None:
            return None
        given = typed(value, self.default)
        fits = given is not None
        if self.options is not None:
            fits = given in self.options
        elif isinstance(given, (int, float)):
            fits = (
                (self.least is None or given >= self.least)
                and (self.most is None or given <= self.most)
                and (self.above is None or given > self.above)
                and (self.below is None or given < self.below)
            )
        if not fits:
            raise ValueError(f"{self.needed(value)} is needed{self.hint(value)}")
        return given


LIMITS: dict[tuple[str | None, str | None], str] = {
    (None, None): "",
    (None, "below"): "less than {below:g}",
    (None, "most"): "of at most {most:g}",
    ("above", None): "greater than {above:g}",
    ("above", "below"): "greater than {above:g} and less than {below:g}",
    ("above", "most"): "greater than {above:g}, at most {most:g}",
    ("least", None): "of at least {least:g}",
    ("least", "below"): "from {least:g} to less than {below:g}",
    ("least", "most"): "from {least:g} to {most:g}",
}
KINDS: tuple[tuple[type | tuple[type, ...], str], ...] = (
    (bool, "true or false"),
    (int, "a whole number"),
    ((float, type(None)), "a finite number"),
    (str, "a word"),
    (list, "a list in brackets"),
    (object, "a value"),
)


def typed(value: Any, default: Any) -> Any:
    """The value as the type of `default`, None when it is of another."""
    if isinstance(default, bool):
        return value if isinstance(value, bool) else None
    if isinstance(default, (int, float, type(None))):
        return as_number(value, whole=isinstance(default, int))
    if isinstance(default, str):
        return value if isinstance(value, str) and value else None
    if isinstance(default, list):
        if not isinstance(value, (list, tuple)):
            return None
        items = [typed(item, default[0]) if default else item for item in value]
        return None if any(item is None for item in items) else items
    return value


def as_number(value: Any, whole: bool) -> float | None:
    """A finite number as a float, or as an int where a whole one is needed; None for all else."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return None
    try:
        number = float(value) + 0.0  # minus zero is zero
    except OverflowError:
        return None
    if not math.isfinite(number) or (whole and not number.is_integer()):
        return None
    if not whole:
        return number
    return value if isinstance(value, int) else int(number)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``; did you mean ...?`` when something similar is known, else nothing."""
    names = list(known)
    near = difflib.get_close_matches(word, names, 1, 0.6)
    if not near:  # a key without its group
        near = [name for name in names if name.rpartition(".")[2] == word]
    return f"; did you mean {near[0]}?" if near else ""


def setting(default: Any, says: str, **more: Any) -> Any:
    """Field of a dataclass that declares a setting; the arguments are those of `Setting`."""
    one = Setting(default, says, **more)
    metadata = {"setting": one}
    if isinstance(default, list):
        return field(default_factory=lambda: list(default), metadata=metadata)
    return field(default=default, metadata=metadata)


def declared(cls: type) -> dict[str, Setting]:
    """Settings of a dataclass by key; a plain default in a derived class changes only that."""
    found: dict[str, Setting] = {}
    for one in reversed(cls.__mro__):
        for key, place in one.__dict__.get("__dataclass_fields__", {}).items():
            if "setting" in place.metadata:
                found[key] = place.metadata["setting"]
            elif key in found:
                found[key] = replace(found[key], default=place.default)
    return {place.name: found[place.name] for place in fields(cls) if place.name in found}


class Settings:
    """Base of the registered dataclasses: an object has only values that are allowed."""

    def __post_init__(self) -> None:
        for key, one in declared(type(self)).items():
            value = getattr(self, key)
            try:
                one.cast(value)
            except ValueError:
                raise BadSetting(key, value, one.needed(value), one.hint(value)) from None
        self.check_together()

    def check_together(self) -> None:
        """Raise `BadSetting` where settings that are allowed each do not fit together."""
