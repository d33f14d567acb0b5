"""Bodies whose size is a key: what follows from it, and that twice the size is the same problem."""

import numpy as np
import pytest

from mpmbench.core import registry
from mpmbench.core.choices import Choices
from mpmbench.core.errors import BadSetting
from mpmbench.core.geometry import divided
from tests.core.support import compose, run
from tests.support import slow_if


def test_square_cells_fill_a_rectangle() -> None:
    assert divided(4.0, 2.0, 6).cells == (6, 3)
    assert divided(0.3, 0.1, 9).cells == (9, 3)
    assert divided(2.0, 5.0, 4).cells == (4, 10)
    with pytest.raises(BadSetting, match=r"multiple of 8 .whole cells over a height of 1 m"):
        divided(8.0, 1.0, 12)
    with pytest.raises(BadSetting, match=r"simple fraction of the length, not 2.71828"):
        divided(1.0, np.e, 12)


@pytest.mark.parametrize(
    ("name", "along"),
    (
        ("soil_column", "width"),
        ("dam_break", "width"),
        ("friction_slope", "length"),
        ("cantilever_dynamic", "length"),
        ("cantilever_self_weight", "length"),
    ),
)
def test_nodes_and_particles_follow_the_size(name: str, along: str) -> None:
    problem = registry.get("problem", name)(**{along: 3.0, "height": 1.5})
    X, V = problem.seed(8, 4)
    assert V.sum() == pytest.approx(4.5) and problem.reference_length == 3.0
    assert X.max(axis=0) == pytest.approx([3.0, 1.5], rel=0.1)
    grid = problem.nodes(8, Choices()).points
    assert (grid.min(axis=0) <= 0.0).all() and (grid.max(axis=0) >= [3.0, 1.5]).all()


def test_half_a_beam_under_twice_its_weight_bends_half_as_far() -> None:
    """Strains are the same when gravity times length is."""
    whole = run("cantilever_self_weight", "implicit_mpm", "linear", resolution=8)
    size = {"problem__length": 4.0, "problem__height": 0.5, "problem__gravity": 2.0 * 9.81}
    half = run("cantilever_self_weight", "implicit_mpm", "linear", resolution=8, **size)
    assert float(half.tip_deflection) == pytest.approx(0.5 * float(whole.tip_deflection), rel=1e-9)
    assert "error_tip" in whole and "error_tip" not in half


# Twice the size. Without weight, twice the time gives the same velocities and stresses; with half the
# weight too; at rest, half the weight or the same traction gives the same stresses.
TWICE = {
    "bar_fixed_ends": ("mpm", {"problem__length": 2.0}, 2.0),
    "bar_dynamic_traction": ("mpm", {"problem__length": 2.0}, 2.0),
    "elastic_bar_tension": ("mpm", {"problem__length": 0.2666}, 2.0),
    "plate_axis_aligned": (
        "mpm",
        {"problem__length": 2.0, "problem__displacement_amplitude": 0.01},
        2.0,
    ),
    "elastic_rings": ("mpm", {"problem__radius": 8.0}, 2.0),
    "two_squares": (
        "mpm",
        {"problem__side": 2.0, "problem__gap": 0.75, "problem__room": 3.0},
        2.0,
    ),
    "six_cubes": ("mpm", {"problem__side": 2.0}, 2.0),
    "vertical_bar": ("mpm", {"problem__length": 2.0, "problem__gravity": 500.0}, 2.0),
    "cook_membrane": ("implicit_mpm", {"problem__width": 0.096}, 1.0),
    "compaction_column": (
        "implicit_mpm",
        {"problem__height": 100.0, "problem__width": 12.5, "problem__gravity": 5.0},
        1.0,
    ),
    "plate_with_hole": ("fem", {"problem__radius": 2.0}, 1.0),
    "radial_ring": (
        "mpm",
        {
            "problem__inner_radius": 0.8,
            "problem__outer_radius": 1.2,
            "problem__displacement_amplitude": 0.2,
        },
        2.0,
    ),
    "generalized_vortex": ("mpm", {"problem__radius": 2.0, "problem__period": 2.0}, 2.0),
    "zalesak_rotation": (
        "linear_fem",
        {
            "problem__radius": 0.3,
            "problem__slot_width": 0.1,
            "problem__slot_depth": 0.5,
            "problem__offset": 0.5,
            "problem__angular_velocity": np.pi,
        },
        2.0,
    ),
    "prestretched_bar": ("mpm", {"problem__length": 80.0}, 2.0),
    "patch_test": ("fem", {"problem__side": 2.0}, 1.0),
    "rigid_motion": ("mpm", {"problem__side": 2.0}, 2.0),
    "bouncing_disk": (
        "mpm",
        {"problem__radius": 0.4, "problem__distance": 0.448528137423857},
        2.0,
    ),
}


OF_TRIANGLES = (
    "bouncing_disk", "elastic_rings", "patch_test", "plate_with_hole", "six_cubes", "two_squares",
)  # fmt: skip


# each is compiled anew with its method and material: those of the longest compilation are slow
@pytest.mark.parametrize(
    "name", [slow_if(name in ("compaction_column", "prestretched_bar"), name) for name in TWICE]
)
def test_twice_the_size_is_the_same_problem(name: str) -> None:
    """Numbers of two powers apart have the same digits: places agree to rounding."""
    method, larger, slower = TWICE[name]
    usual = {
        "resolution": {"compaction_column": 8, "zalesak_rotation": 6}.get(name, 4),
        "particles_per_cell": 1 if name in OF_TRIANGLES else 4,
    }
    changes = usual | larger
    if slower == 2.0:
        step = compose(name, method, "linear")["time_step"]
        few = 0.05 if name == "generalized_vortex" else 0.002  # seconds of some steps of its own
        usual["end_time"] = 4.0 * step if isinstance(step, float) else few
        changes |= {"end_time": 2.0 * usual["end_time"]}
        changes |= {"time_step": 2.0 * step} if isinstance(step, float) else {}
    one, two = run(name, method, "linear", **usual), run(name, method, "linear", **changes)
    moved = np.abs(one.displacement.values[-1]).max()
    assert moved > 0.0
    away = np.abs(two.displacement.values[-1] - 2.0 * one.displacement.values[-1]).max()
    assert away < 1e-9 * moved
    assert two.position.values == pytest.approx(2.0 * one.position.values, rel=1e-12)
    for error in ("error_displacement_rms", "error_velocity_rms", "error_stress_rms"):
        if error in one:
            factor = 2.0 if error == "error_displacement_rms" else 1.0
            assert float(two[error]) == pytest.approx(factor * float(one[error]), rel=1e-6)


def test_a_disk_twice_as_large_is_carried_about_an_axis_twice_as_far_away() -> None:
    sizes = {"radius": 0.15, "slot_width": 0.05, "slot_depth": 0.25, "offset": 0.25}
    disk = registry.get("problem", "zalesak_rotation")
    one = disk(motion="advection")
    two = disk(motion="advection", **{name: 2.0 * size for name, size in sizes.items()})
    assert two.seed(6, 4)[0] == pytest.approx(2.0 * one.seed(6, 4)[0], rel=1e-12)
    for where in ("fixed", "moving"):
        grids = [one.nodes(6, Choices(nodes=where)) for one in (one, two)]
        assert grids[1].points == pytest.approx(2.0 * grids[0].points, rel=1e-12)
        assert grids[1].nodal_spacing == pytest.approx(2.0 * grids[0].nodal_spacing)


def test_sizes_that_make_no_body_are_refused() -> None:
    for name, sizes, sentence in (
        ("radial_ring", {"inner_radius": 0.7}, "a number between 0.7 and 2.1"),
        ("radial_ring", {"outer_radius": 1.3}, "a number between 0.4 and 1.2"),
        ("radial_ring", {"displacement_amplitude": 0.39}, "a number below 0.3857"),
        ("zalesak_rotation", {"slot_width": 0.3}, r"less than 0.3 \(the diameter\)"),
        ("zalesak_rotation", {"slot_depth": 0.4}, r"less than 0.3 \(the diameter\)"),
    ):
        with pytest.raises(BadSetting, match=sentence):
            registry.get("problem", name)(**sizes)


def test_what_a_larger_vortex_should_have() -> None:
    """Angular momentum by rho r^4/T, kinetic energy by rho r^4/T^2, strain energy by mu r^2: per metre of depth."""
    changes = {"resolution": 4, "end_time": 0.02}
    one = run("generalized_vortex", "mpm", "linear", **changes)
    two = run(
        "generalized_vortex", "mpm", "linear", problem__radius=2.0, problem__period=2.0,
        resolution=4, end_time=0.04,
    )  # fmt: skip
    for name, factor in (
        ("angular_momentum", 8.0),
        ("kinetic_energy", 4.0),
        ("strain_energy", 4.0),
    ):
        exact = one[f"{name}_exact"].values
        assert np.abs(exact).max() > 0.0
        assert two[f"{name}_exact"].values == pytest.approx(factor * exact, rel=1e-9)
    error = float(one.error_angular_momentum)
    assert float(two.error_angular_momentum) == pytest.approx(error, rel=1e-6)


def test_a_larger_block_of_corners_turns_and_stretches_about_its_middle() -> None:
    block = registry.get("problem", "rigid_motion")
    choices = {"motion": "rotation", "particle_layout": "nodes", "stretch": 0.5}
    (x, volume), (larger, more) = (block(side=side, **choices).seed(3, 4) for side in (1.0, 2.0))
    assert larger == pytest.approx(2.0 * x) and more == pytest.approx(4.0 * volume)
    assert more.sum() == pytest.approx(4.0)
    one, two = (
        block(side=side, **choices).velocity(at, None) for side, at in ((1.0, x), (2.0, larger))
    )
    assert two == pytest.approx(2.0 * one) and np.abs(one).max() > 0.0
