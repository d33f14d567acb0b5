"""From a resolved configuration to the plug-ins of one run, with all that speaks against it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from mpmbench.core import registry
from mpmbench.core.bases import BasisSettings
from mpmbench.core.bodies import Part, overlap
from mpmbench.core.compiled import has_version
from mpmbench.core.contact import ContactRule, check_bodies
from mpmbench.core.contact.shared import Shared
from mpmbench.core.errors import BadSetting, NotApplicable, require
from mpmbench.core.geometry import Box
from mpmbench.core.loops import TimeLoop, find_loop
from mpmbench.core.materials import Material
from mpmbench.core.moved import complete
from mpmbench.core.particles import particle_data
from mpmbench.core.setting import declared
from mpmbench.core.transfer import find_transfer
from mpmbench.problems import Problem

Config = Mapping[str, Any]


@dataclass(frozen=True)
class Case:
    """The plug-ins of one run, with their settings checked."""

    problem: Problem
    choices: TimeLoop
    basis: BasisSettings
    material: Material
    basis_name: str
    resolution: int
    particles_per_cell: int
    contact: ContactRule = field(default_factory=Shared)


def read(config: Config) -> Case:
    """Instantiate the plug-ins of a configuration.

    Raises
    ------
    BadSetting
        With the full key of the setting, for example ``basis.d_max``.
    NotApplicable
        When the combination cannot be run.
    """
    method = dict(config["method"])
    try:
        loop = find_loop(method["time"])
    except KeyError:
        loops = "one of " + ", ".join(registry.names("method"))
        raise BadSetting("method.time", method["time"], loops) from None
    choices = instantiate("method", loop, method)
    chosen = {"contact": {"name": "shared"}, **config}
    kinds = ("problem", "basis", "material", "contact")
    built = {kind: plugin(kind, chosen[kind]) for kind in kinds}
    if any(field.name == "random_seed" for field in fields(built["problem"])):
        built["problem"] = replace(built["problem"], random_seed=int(config.get("seed", 0)))
    complete(type(built["problem"]), Problem)
    built["problem"] = built["problem"].suited_to(choices)
    resolution, per_cell = int(config["resolution"]), int(config["particles_per_cell"])
    require(resolution >= 1, "resolution", config["resolution"], "a whole number >= 1")
    case = Case(
        **built,
        choices=choices,
        basis_name=config["basis"]["name"],
        resolution=resolution,
        particles_per_cell=per_cell,
    )
    problem, dimension = case.problem, case.problem.dimension
    problem.check_particles(per_cell)
    complete(type(case.basis), BasisSettings)
    complete(type(case.material), Material)
    if not choices.moves_particles and not problem.still:
        raise NotApplicable(
            f"method={choices.name} moves nothing, and {config['problem']['name']} is about motion"
        )
    choices.check(case)
    case.basis.check(choices, problem.touches_fixed_nodes)
    if choices.moving and not case.basis.promises.moves:
        raise NotApplicable(f"basis={case.basis_name} has nodes that cannot move")
    if choices.moving and problem.bends and not case.basis.promises.bends:
        raise NotApplicable(
            f"basis={case.basis_name} on moving nodes keeps lines along the axes straight, and "
            f"{config['problem']['name']} bends or turns them"
        )
    needs = choices.stress
    if needs is not None and not has_version(needs, type(case.material.law)):
        name = config["material"]["name"]
        raise NotApplicable(
            f"method.time={choices.time} needs {needs.__name__}, which material={name} does not have"
        )
    if dimension not in case.basis.promises.dimensions:
        raise NotApplicable(f"basis={case.basis_name} does not exist in {dimension}D")
    problem.check(case.material, choices, case.basis_name, resolution)
    if case.basis.promises.grid and not isinstance(problem.nodes(resolution, choices), Box):
        raise NotApplicable(
            f"basis={case.basis_name} needs a grid, and {config['problem']['name']} has free nodes"
        )
    check_bodies(case, bodies_of(case))
    if problem.loads(case.material).walls and not choices.meets_walls:
        raise NotApplicable(
            f"method.time={choices.time} knows no walls that let go, and "
            f"{config['problem']['name']} has one"
        )
    if choices.particles_are_nodes:
        _refuse_other_particles(case)
    return case


def bodies_of(case: Case) -> tuple[Part, ...]:
    """The bodies of a problem that has several; raises `BadSetting` when two of them overlap."""
    parts = tuple(case.problem.bodies(case.resolution, case.particles_per_cell))
    made = case.problem.materials(case.material) or (case.material,) * len(parts)
    parts = tuple(replace(part, material=one) for part, one in zip(parts, made, strict=True))
    found = overlap(parts)
    if found is not None:
        one, other, depth = found
        raise BadSetting(
            "problem",
            f"{one} and {other}",
            f"room between the bodies, which overlap by {depth:.3g} m,",
        )
    return parts


def _refuse_other_particles(case: Case) -> None:
    """Refuse particles that are not the nodes."""
    nodes = case.problem.nodes(case.resolution, case.choices).points
    X, _ = case.problem.seed(case.resolution, case.particles_per_cell)
    if X.shape == nodes.shape and np.allclose(X, nodes, rtol=0.0, atol=1e-9 * np.ptp(nodes)):
        return
    layouts = declared(type(case.problem)).get("particle_layout")
    remedy = ""
    if layouts is not None and "nodes" in (layouts.options or ()):
        remedy = ": set problem.particle_layout=nodes"
    raise NotApplicable(
        f"method={case.choices.name} has no nodes of its own: its {len(X)} particles must be the "
        f"{len(nodes)} nodes{remedy}"
    )


def plugin(kind: str, settings: Mapping[str, Any]) -> Any:
    """The plug-in that settings name, with the rest of them; raises as `instantiate` does."""
    own = {key: value for key, value in settings.items() if key != "name"}
    return instantiate(kind, registry.get(kind, settings["name"]), own)


def instantiate(kind: str, cls: type, settings: Mapping[str, Any]) -> Any:
    """A plug-in with its settings; raises `BadSetting` with the full key of one that is wrong."""
    known = {field.name for field in fields(cls)}
    for key in settings:
        allowed = f"a key that {kind} has ({', '.join(sorted(known))})"
        require(key in known, f"{kind}.{key}", settings[key], allowed)
    try:
        return cls(**settings)
    except BadSetting as error:
        raise BadSetting(f"{kind}.{error.key}", error.value, error.allowed, error.hint) from None


def estimate_memory(config: Config) -> float:
    """Upper estimate of the memory that a run takes [MiB]; raises as `read` does."""
    case = read(config)
    dim = case.problem.dimension
    geometry = case.problem.nodes(case.resolution, case.choices)
    cells = (
        float(np.prod([float(n) for n in geometry.cells]))
        if isinstance(geometry, Box)
        else len(geometry.nodes)
    )
    further = particle_data(find_transfer(case.choices.transfer), case.basis, case.material)
    numbers = 8 + 5 * dim + 3 * dim**2
    numbers += sum(math.prod(one.shape(dim)) for one in further.values())
    particle = 8.0 * numbers * 4  # arrays, their snapshots, and the state that is warmed up
    stores = case.choices.moving or case.choices.gradient == "affine"
    clouds = stores or not case.basis.promises.grid
    stencil = 8.0 * 5**dim * (2 + 2 * dim) if clouds else 0.0
    band = 0.0
    if case.choices.implicit:  # the places of a particle's pairs of functions in the matrix
        stencil += 4.0 * ((3**dim) ** 2 if clouds else (2**dim) ** 2)
        cells_across = cells ** (1.0 - 1.0 / dim)
        band = 8.0 * dim * min(9.0 * dim * cells_across, 2000.0)
    node = 8.0 * (1 + 8 * dim) + (8.0 * 3 * 5**dim if case.choices.mass == "consistent" else 0.0)
    return (cells * case.particles_per_cell * (particle + stencil) + cells * (node + band)) / 2**20
