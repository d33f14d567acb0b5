"""The settings of a method are those of its time loop, also when another loop is chosen."""

import subprocess
import sys

import pytest

from mpmbench.runs.hydra.compose import compose_many
from mpmbench.settings.loops import settings_of_loop


def test_a_loop_without_a_setting_drops_it_unless_it_was_given() -> None:
    """The problem takes Newmark's method for a static loop, which has no parameters of Newmark's."""
    words = ["problem=patch_test", "method=gmm"]
    ((config, reason),) = compose_many([words])
    assert config["method"]["time"] == "static" and not reason
    assert not {key for key in config["method"] if key.startswith("newmark")}
    assert config["method"]["residual_tolerance"] == 1e-8
    ((_, reason),) = compose_many([[*words, "method.newmark_velocity=0.6"]])
    assert reason == "method.time=static has no newmark_velocity"


@pytest.mark.parametrize("name", ("explicit", "newmark", "static", "sph", "evaluate"))
def test_settings_are_read_from_the_text_as_they_are_in_the_class(name: str) -> None:
    from dataclasses import fields

    from mpmbench.core.loops import find_loop

    expected = {field.name: field.default for field in fields(find_loop(name))}
    assert settings_of_loop(name) == expected


def test_reading_them_imports_no_compiler() -> None:
    script = (
        "import sys; from mpmbench.settings.loops import settings_of_loop; "
        "assert settings_of_loop('newmark'); assert 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
