"""Simulations of bodies made in Python: the same numbers as the run of a problem, and no file."""

import numpy as np
import pytest

import mpmbench
from mpmbench import Body, Box, Particles, make, seed_cells, simulate

AMPLITUDE = 0.6


def bar(cells: int = 8) -> Body:
    law = make("material", "small_strain_elastic", young_modulus=4000.0, density=1.0)
    box = Box((0.0,), (1.0,), (cells,))
    particles = Particles.at_rest(*seed_cells(box, 12), law.density)
    particles.v[:] = AMPLITUDE * np.sin(np.pi * particles.X)
    return Body(
        box,
        particles,
        fixed=lambda x: (x < 1e-12) | (x > 1.0 - 1e-12),
        velocity=lambda x: AMPLITUDE * np.sin(np.pi * x),
        initial_acceleration="zero",  # as the problem says
    )


LAW = make("material", "small_strain_elastic", young_modulus=4000.0, density=1.0)


def test_a_script_gives_the_bits_of_the_same_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = mpmbench.run(method="mpm", basis="linear", resolution=8, end_time=5e-4)
    assert run.attrs["problem"] == "bar_fixed_ends"
    monkeypatch.chdir(tmp_path.parent)
    body = bar()
    result = simulate(body, "linear", LAW, "mpm", time_step=1e-5, end_time=5e-4)
    assert result.status == "ok" and int(result.steps) == 50
    for name in ("position", "velocity", "stress", "kinetic_energy"):
        assert np.array_equal(result[name], run[name]), name
    assert np.array_equal(body.particles.x, body.particles.X)  # the body is not changed


def test_a_failure_is_a_result(tmp_path):
    result = simulate(bar(), "linear", LAW, "mpm", time_step=0.5, end_time=50.0)
    assert result.status in ("diverged", "broke_down") and "step" in result.reason


def test_what_makes_no_sense_is_refused():
    with pytest.raises(mpmbench.BadInput, match="did you mean bspline"):
        make("basis", "bsplin")
    with pytest.raises(mpmbench.BadSetting, match=r"basis.degree = 7"):
        make("basis", "bspline", degree=7)
    with pytest.raises(mpmbench.BadInput, match="none of method"):
        make("problem", "bar_fixed_ends")
    with pytest.raises(mpmbench.NotApplicable, match="sph_kernel"):
        simulate(bar(), "linear", LAW, "sph", time_step=1e-5, end_time=1e-4)
