"""Keys of a configuration that say where, when and how patiently something runs; and keys that came later."""

from collections.abc import Iterator
from typing import Any

# What does not change a result, so that changing it makes no finished run worthless.
NOT_PART_OF_A_RUN = (
    "output_dir",
    "campaign",
    "limits",
    "on_error",
    "report",
    "rerun",
    "timing",
    "repeats",
)

# Keys that came after results were stored, by choice, with the value that does what was done
# before: a configuration without such a key means this value, and one with it has the hash of then.
LATER: dict[tuple[str, str], dict[str, Any]] = {
    ("basis", "bspline"): {"reconstruction": "none", "reconstruction_degree": 1, "filled": 0.9},
    ("basis", "mls"): {"mixed_terms": False},
    ("material", "newtonian_fluid"): {"tension": "carried"},
    ("problem", "bar_dynamic_traction"): {"length": 1.0},
    ("problem", "bar_fixed_ends"): {"length": 1.0},
    ("problem", "cantilever_dynamic"): {"behind": "room", "length": 4.0, "height": 1.0},
    ("problem", "cantilever_self_weight"): {"length": 8.0, "height": 1.0},
    ("problem", "compaction_column"): {"rise_time": 1.0, "height": 50.0},
    ("problem", "cook_membrane"): {"width": 0.048},
    ("problem", "elastic_bar_tension"): {"length": 0.1333},
    ("problem", "elastic_rings"): {"radius": 4.0},
    ("problem", "friction_slope"): {"length": 0.1, "height": 0.05},
    ("problem", "generalized_vortex"): {"radius": 1.0},
    ("problem", "patch_test"): {"particle_layout": "triangles", "side": 1.0},
    ("problem", "plate_axis_aligned"): {"length": 1.0},
    ("problem", "plate_with_hole"): {"radius": 1.0},
    ("problem", "prestretched_bar"): {"length": 40.0},
    ("problem", "radial_ring"): {"inner_radius": 0.4, "outer_radius": 0.6},
    ("problem", "rigid_motion"): {"side": 1.0},
    ("problem", "rolling_disk"): {"plane": "nodes", "friction": None},
    ("problem", "six_cubes"): {"side": 1.0},
    ("problem", "soil_column"): {"width": 4.0, "height": 2.0},
    ("problem", "two_squares"): {"side": 1.0, "slip": 0.0},
    ("problem", "vertical_bar"): {"length": 1.0},
    ("problem", "zalesak_rotation"): {
        "radius": 0.15,
        "slot_width": 0.05,
        "slot_depth": 0.25,
        "offset": 0.25,
    },
}
# The same for keys of all methods whose time loop is the explicit or the implicit one or derives
# from it, which those have that have the first key.
LATER_OF_LOOPS: dict[str, dict[str, Any]] = {
    "mass_cutoff": {"transfer_order": 2, "gradient": "functions", "separation": 1.0, "drag": 0.0},
    "step_halvings": {"volumetric": "standard", "gradient": "functions"},
}
# Groups that came later, with the choice that does what was done before.
LATER_GROUPS: dict[str, dict[str, Any]] = {"contact": {"name": "shared"}}


def with_later(config: dict[str, Any]) -> dict[str, Any]:
    """A stored configuration, with the keys that it was too early to have."""
    whole = (LATER_GROUPS if "problem" in config else {}) | config
    return whole | {group: later | config[group] for group, later in _later(config)}


def without_later(config: dict[str, Any]) -> dict[str, Any]:
    """A configuration without the keys that came later, where they do what was done before."""
    config = {key: one for key, one in config.items() if LATER_GROUPS.get(key) != one}
    return config | {
        group: {key: one for key, one in config[group].items() if (key, one) not in later.items()}
        for group, later in _later(config)
    }


def _later(config: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Groups of this configuration whose choice has keys that came later, and these keys."""
    for (group, name), later in LATER.items():
        if config.get(group, {}).get("name") == name:
            yield group, later
    for key, later in LATER_OF_LOOPS.items():
        if key in config.get("method", {}):
            yield "method", later
