"""What can be set is read from the text of classes: the same as what Python makes of them."""

import subprocess
import sys
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from mpmbench.case.read import read
from mpmbench.core import registry
from mpmbench.core import setting as declarations_in_python
from mpmbench.core.setting import Setting
from mpmbench.settings import schema
from mpmbench.settings.files import BadInput
from tests.core.support import compose

OPTIONS = [
    (group, name) for group in ("basis", "material", "problem") for name in schema.options(group)
]
LOOPS = ("evaluate", "explicit", "newmark", "sph", "static")


@pytest.mark.parametrize(("group", "name"), OPTIONS)
def test_the_text_says_what_python_makes_of_it(group: str, name: str) -> None:
    plugin = registry.get(group, name)
    read = schema.declaration(group, name)
    assert read.settings == declarations_in_python.declared(plugin)
    assert read.sentence and (plugin.__doc__ or "").startswith(read.sentence)
    own = {field.name for field in fields(plugin)} - {"random_seed"}
    assert set(read.settings) == own == set(schema.declared(group, name))
    assert all(one.says for one in read.settings.values())


@pytest.mark.parametrize("name", LOOPS)
def test_the_text_of_a_loop_says_what_python_makes_of_it(name: str) -> None:
    loop = registry.get("method", name)
    read = schema.declaration("method", name).settings
    assert list(read)[:2] == ["name", "time"]  # from the preset: they are nothing to be set
    settings = {key: one for key, one in read.items() if key not in ("name", "time")}
    assert settings == declarations_in_python.declared(loop)
    assert {"name", "time", *settings} == {field.name for field in fields(loop)}
    assert all(one.says for one in settings.values())


def test_a_preset_chooses_whether_there_is_a_ghost_stiffness() -> None:
    owners = [
        m for m in schema.options("method") if "ghost_stiffness" in schema.declared("method", m)
    ]
    assert owners == ["implicit_mpm"]
    assert schema.declared("method", "implicit_mpm")["ghost_stiffness"].below == 1.0


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    def write(text: str, name: str = "flower", **yaml: str) -> None:
        folder = tmp_path / name
        folder.mkdir()
        (folder / f"{name}.py").write_text(text)
        for group, content in yaml.items():
            (folder / "conf" / group).mkdir(parents=True)
            (folder / "conf" / group / f"{name}.yaml").write_text(content)
        monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))

    return write


ONE_FILE = '''
"""A basis."""
from dataclasses import dataclass

from mpmbench import register
from mpmbench.core.bases.entropy.maxent import MaxEnt
from mpmbench.core.setting import setting

import this_module_does_not_exist


@register("basis", "flower")
@dataclass(
    frozen=True
)
class MaxEntOfFlowers(MaxEnt):
    """Functions like petals. They smell."""

    petals: int = setting(
        5, "of one flower", unit="-", least=3
    )
    d_max: float = 3.0

    def build(
        self, geometry, particles
    ):
        """Text
that is not indented."""

    scent: str = setting("rose", "it has", options=("rose", "none"))
'''


def test_one_file_is_all_that_a_plugin_needs(plugin) -> None:
    plugin(ONE_FILE)
    assert "flower" in schema.options("basis")
    assert schema.description("basis", "flower") == "Functions like petals."
    keys = schema.declared("basis", "flower")
    assert list(keys)[-2:] == ["petals", "scent"]
    assert keys["petals"] == Setting(5, "of one flower", "-", least=3)
    assert keys["scent"].options == ("rose", "none")
    assert keys["d_max"].default == 3.0 and keys["d_max"].most == 10.0
    assert schema.composed("basis", "flower")["basis"]["prior"] == "cubic_spline"
    assert "basis.petals" in schema.all_keys()


OLD = '''
from dataclasses import dataclass
from typing import ClassVar
import math

from mpmbench.core.materials.isotropic import IsotropicElastic
from mpmbench.core.registry import register


@register("material", "flower")
@dataclass(frozen=True)
class Flower(IsotropicElastic):
    """A law of flowers."""

    stalks: int = 2
    height: float = math.pi
    count: ClassVar[int] = 3
'''


def test_old_plugins_have_plain_defaults_and_a_preset(plugin) -> None:
    plugin(OLD, material="# Flowers, by their file.\nname: flower\ndensity: 7.0\nheight: 3.0\n")
    keys = schema.declared("material", "flower")
    assert list(keys) == ["young_modulus", "poisson_ratio", "density", "stalks", "height"]
    assert (keys["density"].default, keys["density"].above) == (7.0, 0.0)
    assert (keys["stalks"].default, keys["height"].default) == (2, 3.0)
    assert schema.description("material", "flower") == "A law of flowers."


LOOP = '''
from mpmbench import register
from mpmbench.core.setting import Settings, setting


@register("method", "circling")
class Circling(Settings):
    """A loop."""

    name: str = "none"
    nodes: str = "fixed"
    traction: str = "end_point"
    rounds: int = setting(2, "of the loop", least=1)
    pause: float = setting(0.0, "after each", by_preset=True)
'''


@pytest.mark.parametrize(
    "preset",
    (
        "# @package _global_\n# Turns.\nmethod: {name: flower, time: circling, nodes: moving}\n",
        "# Turns.\nmethod: {time: circling, nodes: moving}\n",
        "# Turns.\ntime: circling\nnodes: moving\n",
    ),
)
def test_keys_of_a_method_are_those_of_its_loop_and_of_its_preset(plugin, preset: str) -> None:
    plugin(LOOP, method=preset)
    keys = schema.declared("method", "flower")
    assert {key: one.default for key, one in keys.items()} == {
        "nodes": "moving", "rounds": 2, "time": "circling",
    }  # fmt: skip
    assert keys["rounds"].least == 1
    assert schema.composed("method", "flower")["method"]["name"] == "flower"
    assert schema.description("method", "flower") == "Turns."


def test_a_declaration_that_is_no_literal_is_named(plugin) -> None:
    plugin(ONE_FILE.replace('5, "of one flower"', '2 * FIVE, "of one flower"'))
    with pytest.raises(BadInput, match=r"flower\.py: petals: literals are needed in setting\(\)"):
        schema.declared("basis", "flower")


def test_seed_reaches_every_random_problem() -> None:
    """One name for all: the key ``seed``, which is no key of the problem."""
    random = [
        name
        for name in schema.options("problem")
        if "random_seed" in {field.name for field in fields(registry.get("problem", name))}
    ]
    assert random == [
        "elastic_bar_tension", "isothermal_shock", "lme_shape_functions", "patch_test", "prestretched_bar",
        "shape_functions",
    ]  # fmt: skip
    for seed in (0, 7):
        config = compose("patch_test", "fem", "linear", seed=seed, resolution=4)
        assert read(config).problem.random_seed == seed
    first, second = (
        read(compose("patch_test", "fem", "linear", seed=seed)).problem.nodes(4, None).nodes
        for seed in (0, 7)
    )
    assert abs(first - second).max() > 1e-3


def test_defaults_that_python_needs_are_there() -> None:
    for group, name in OPTIONS:
        for field in fields(registry.get(group, name)):
            assert field.default is not MISSING or field.default_factory is not MISSING


@pytest.mark.parametrize("words", (["list"], ["list", "maxent"], ["--help", "basis=lme"]))
def test_nothing_heavy_is_imported_to_show_what_can_be_set(words: list[str]) -> None:
    code = (
        f"import sys; from mpmbench.cli import main; assert main({words}) == 0;"
        "heavy = {'numba', 'numpy', 'xarray', 'matplotlib', 'scipy', 'hydra'} & set(sys.modules);"
        "assert not heavy, heavy"
    )
    root = str(Path(__file__).parents[2])
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, cwd=root)


def test_words_show_unit_sentence_and_range(capsys) -> None:
    from mpmbench.cli import main

    assert main(["list", "maxent"]) == 0
    shown = capsys.readouterr().out
    for words in (["--help", "basis=maxent"], ["list", "maxent"]):
        assert main(words) == 0
        line = "basis.d_max: 2.0           [-] radius of the prior's support in node spacings"
        text = capsys.readouterr().out
        assert line in text and "(greater than 1, at most 10)" in text
    assert "basis.search: local" in shown and "(local | all)" in shown


def test_every_problem_alone_is_a_run():
    """The problem names a method, and a basis through it, that apply to it."""
    from mpmbench.case import read
    from mpmbench.runs.hydra.compose import compose_many

    problems = schema.options("problem")
    for config, reason in compose_many([[f"problem={name}"] for name in problems]):
        assert not reason
        read(config)  # raises what speaks against it
