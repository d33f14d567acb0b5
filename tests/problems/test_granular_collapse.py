"""The granular column: published laws of its run-out, and how far a run is from them."""

import math

import numpy as np
import pytest

from mpmbench.core import registry
from tests.core.support import run

GRAINS = {
    "material__young_modulus": 1e6,
    "material__density": 2600.0,
    "material__cohesion": 0.0,
    "material__friction_angle": 30.0,
}


def test_laws_of_lube() -> None:
    """Both branches, nothing in between, and a floor as rough as the grains."""
    column = registry.get("problem", "granular_collapse")
    assert column(aspect=0.5).expected() == (pytest.approx(0.6), 0.5)
    assert column(aspect=2.0).expected() == (None, pytest.approx(1.1 * 2.0**0.4))
    assert column(aspect=4.0).expected()[0] == pytest.approx(1.9 * 4.0 ** (2.0 / 3.0))
    material = registry.get("material", "mohr_coulomb")(friction_angle=30.0)
    assert column().loads(material).walls[0].friction == pytest.approx(1.0 / math.sqrt(3.0))
    assert column(aspect=4.0).length > 1.3 * 0.1 * (1.0 + column(aspect=4.0).expected()[0])


@pytest.mark.slow
def test_a_column_as_high_as_wide_comes_to_rest_within_the_published_band() -> None:
    result = run(
        "granular_collapse",
        "mpm",
        "bspline",
        resolution=8,
        end_time=0.4,
        method__transfer="apic",
        **GRAINS,
    )
    assert float(result.error_run_out) == abs(float(result.excess_of_run_out)) < 0.25
    assert abs(float(result.excess_of_height)) < 0.25
    assert float(result.kinetic_share) < 1e-4  # at rest
    assert np.all(np.diff(result.front.values) > -1e-3 * 0.1)  # and it does not go back
    assert float(result.volume[-1].sum() / result.volume[0].sum()) == pytest.approx(1.0, abs=0.03)
