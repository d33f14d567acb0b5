"""A setting is declared once: its range, its type and its words all come from that line."""

import math
from dataclasses import dataclass

import pytest

from mpmbench.core.errors import BadSetting, require
from mpmbench.core.setting import Setting, Settings, declared, setting


@dataclass(frozen=True)
class Tent(Settings):
    """A tent."""

    height: float = setting(2.0, "above the ground", unit="m", above=1.0, most=10.0)
    poles: int = setting(3, "number of them", least=1, most=20)
    colour: str = setting("green", "of the cloth", options=("green", "yellow"))
    sides: int = setting(1, "on which it opens", options=(1, 2))
    slope: float = setting(0.3, "of the roof", above=-1.0, below=0.5)
    stiffness: float = setting(0.0, "of the cloth", least=0.0, below=1.0)
    length: float | None = setting(None, "null: as the height", unit="m", least=0.0)
    waterproof: bool = setting(True, "it keeps rain out")
    pegs: list[float] = setting([0.5], "where they stand", unit="m")

    def check_together(self) -> None:
        require(self.height < self.poles + 4, "height", self.height, "less than poles + 4")


@dataclass(frozen=True)
class Yurt(Tent):
    """A yurt."""

    height: float = 3.0


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("height", 1.0, "height = 1.0: a number greater than 1, at most 10 is needed"),
        ("height", 10.5, "height = 10.5: a number greater than 1, at most 10 is needed"),
        ("height", math.nan, "height = nan: a number greater than 1, at most 10 is needed"),
        ("height", math.inf, "height = inf: a finite number is needed"),
        ("height", "tall", "height = 'tall': a number greater than 1, at most 10 is needed"),
        ("height", True, "height = True: a number greater than 1, at most 10 is needed"),
        ("poles", 0, "poles = 0: a whole number from 1 to 20 is needed"),
        ("poles", 2.5, "poles = 2.5: a whole number from 1 to 20 is needed"),
        ("poles", 10**400, f"poles = {10**400}: a whole number from 1 to 20 is needed"),
        ("colour", "gren", "colour = 'gren': one of green, yellow is needed; did you mean green?"),
        ("colour", "", "colour = '': one of green, yellow is needed"),
        ("sides", 3, "sides = 3: one of 1, 2 is needed"),
        ("slope", 0.5, "slope = 0.5: a number greater than -1 and less than 0.5 is needed"),
        ("slope", -1.0, "slope = -1.0: a number greater than -1 and less than 0.5 is needed"),
        ("stiffness", 1.0, "stiffness = 1.0: a number from 0 to less than 1 is needed"),
        ("length", -1.0, "length = -1.0: a number of at least 0, or null, is needed"),
        ("waterproof", 1, "waterproof = 1: true or false is needed"),
        ("pegs", 0.5, "pegs = 0.5: a list in brackets is needed"),
        ("pegs", ["a"], "pegs = ['a']: a list in brackets is needed"),
        ("height", 8.0, "height = 8.0: less than poles + 4 is needed"),
    ],
)
def test_an_object_has_only_values_that_are_allowed(key: str, value: object, message: str) -> None:
    with pytest.raises(BadSetting) as caught:
        Tent(**{key: value})
    assert str(caught.value) == message
    assert caught.value.key == key


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"height": 1.000001},
        {"height": 5},
        {"poles": 1},
        {"poles": 20, "height": 10.0},
        {"colour": "yellow", "sides": 2},
        {"slope": 0.49999},
        {"stiffness": 0.0, "length": 0.0},
        {"length": None, "waterproof": False, "pegs": []},
    ],
)
def test_limits_that_are_allowed_themselves(given: dict[str, object]) -> None:
    tent = Tent(**given)  # type: ignore[arg-type]
    for key, value in given.items():
        assert getattr(tent, key) == value


def test_values_are_cast_to_the_type_of_the_default() -> None:
    one = declared(Tent)
    assert repr(one["height"].cast(2)) == "2.0"
    assert repr(one["poles"].cast(4.0)) == "4"
    assert repr(one["stiffness"].cast(-0.0)) == "0.0"
    assert one["pegs"].cast([1, 2]) == [1.0, 2.0]
    assert one["length"].cast(None) is None


def test_a_plain_default_in_a_derived_class_changes_only_the_default() -> None:
    assert Yurt().height == 3.0
    assert declared(Yurt)["height"] == Setting(3.0, "above the ground", "m", above=1.0, most=10.0)
    with pytest.raises(BadSetting, match="greater than 1, at most 10"):
        Yurt(height=0.5)
    assert list(declared(Yurt)) == list(declared(Tent))


def test_lists_are_not_shared() -> None:
    Tent().pegs.append(1.0)
    assert Tent().pegs == [0.5]
