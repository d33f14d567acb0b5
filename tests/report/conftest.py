"""Synthetic result files with the layout that the run layer promises; no solver is involved.

The fixtures hand out the functions, so that no test module has to import from this file.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from mpmbench.report import writer
from mpmbench.results.version import SCHEMA_VERSION
from tests.support import write

MATERIAL = {"name": "linear_elastic", "young_modulus": 4000.0, "poisson_ratio": 0.0, "density": 1.0}
UNITS = {
    "error_displacement_rms": "m",
    "error_stress_rms": "Pa",
    "error_velocity_rms": "m/s",
    "solver_time": "s",
    "compile_time": "s",
    "wall_time": "s",
    "peak_memory": "MiB",
    "time_reached": "s",
    "predicted_temporal_floor": "m",
}
FLOOR = 2.764e-10


def make_run(
    folder: Path,
    method: str = "mpm",
    basis: str = "linear",
    resolution: int = 8,
    problem: str = "bar_fixed_ends",
    status: str = "ok",
    reason: str = "",
    time_step: float = 1e-5,
    particles_per_cell: int = 12,
    mass: str = "lumped",
    settings: dict[str, dict[str, Any]] | None = None,
    timing_context: str = "exclusive",
    order: float = 2.0,
    constant: float = 1e-3,
    floor: float = FLOOR,
    dimension: int = 1,
    snapshot: bool = True,
    scalars: dict[str, float] | None = None,
    code_hash: str = "aaaa",
    file: Path | None = None,
) -> Path:
    """Write one result file whose displacement error is ``constant * resolution**-order + floor`` [m]."""
    extra = settings or {}
    config = {
        "problem": {"name": problem, "velocity_amplitude": 0.6} | extra.get("problem", {}),
        "method": {"name": method, "mass": mass, "transfer": "flip"} | extra.get("method", {}),
        "basis": {"name": basis} | extra.get("basis", {}),
        "material": MATERIAL | extra.get("material", {}),
        "resolution": resolution,
        "time_step": time_step,
        "end_time": 1e-3,
        "particles_per_cell": particles_per_cell,
        "threads": 1,
        "seed": 0,
        "campaign": "synthetic",
        **{group: extra[group] for group in ("contact",) if group in extra},
        "timing": "shared",
        "limits": {"time": 100.0, "memory": None},
    }
    text = json.dumps(config, sort_keys=True)
    digest = hashlib.sha256(text.encode()).hexdigest()
    error = constant * float(resolution) ** -order + floor
    particles = (resolution * round(particles_per_cell ** (1 / dimension))) ** dimension
    values = {
        "error_displacement_rms": error,
        "error_stress_rms": 1e4 * error,
        "error_velocity_rms": 10.0 * error,
        "error_displacement_relative": 1e3 * error,
        "energy_drift": 1e-6,
        "momentum_drift": 1e-12,
        "steps": 100.0,
        "n_particles": float(particles),
        "n_nodes": resolution + 1.0,
        "n_cell_crossings": 0.0,
        "solver_time": 1e-4
        * resolution
        * (3.0 if basis == "maxent" else 1.0)
        * (1.2 if method == "otm" else 1.0),
        "compile_time": 2.0,
        "wall_time": 3.0,
        "peak_memory": 200.0,
        "time_reached": 1e-3,
        "predicted_temporal_floor": floor,
    } | (scalars or {})
    variables: dict[str, Any] = {}
    if status != "ok":
        values = {"steps": 7.0, "time_reached": 7e-5} | (scalars or {})
        snapshot = False
    for name, value in values.items():
        attributes = {"units": UNITS.get(name, "1"), "long_name": name.replace("_", " ")}
        variables[name] = ((), value, attributes)
    times = np.linspace(0.0, 1e-3, 11)
    for name in ("kinetic_energy", "strain_energy", "external_work"):
        variables[name] = (("time",), np.cos(times) ** 2, {"units": "J"})
    variables["momentum"] = (("time", "dim"), np.zeros((11, dimension)), {"units": "N s"})
    if snapshot:
        variables |= _fields(particles, dimension, error)
    dataset = xr.Dataset(variables, coords={"time": ("time", times, {"units": "s"})})
    dataset.attrs = {
        "schema_version": SCHEMA_VERSION,
        "status": status,
        "reason": reason,
        "config": text,
        "config_hash": digest[:16],
        "problem": problem,
        "method": method,
        "basis": basis,
        "material": "linear_elastic",
        "mass": mass,
        "resolution": resolution,
        "time_step": time_step,
        "particles_per_cell": particles_per_cell,
        "mpmbench_version": "0.1.0",
        "git_commit": "0" * 40,
        "git_dirty": "no",
        "code_hash": code_hash,
        "code_files": "{}",
        "python": "3.11.9",
        "numpy_version": "2.0.0",
        "host": "synthetic",
        "cpu": "none",
        "threads": 1,
        "started": "2020-01-01T00:00:00",
        "timing_context": timing_context,
        "Conventions": "CF-1.11",
    }
    file = file or folder / f"{method}-{basis}-{problem}-n{resolution}-{digest[:8]}.nc"
    write(dataset, file)
    return file


def _fields(particles: int, dimension: int, error: float) -> dict[str, Any]:
    """A first mode of a bar or plate, with an oscillating error of the stress."""
    per_axis = round(particles ** (1 / dimension))
    line = (np.arange(per_axis) + 0.5) / per_axis
    initial = np.stack(
        [part.ravel() for part in np.meshgrid(*[line] * dimension, indexing="ij")], axis=1
    )
    displacement = 1e-2 * np.sin(np.pi * initial)
    stress = np.zeros((2, particles, dimension, dimension))
    for d in range(dimension):
        stress[1, :, d, d] = 100.0 * np.cos(np.pi * initial[:, d])
    noisy = stress + 1e7 * error * np.sin(37.0 * initial[:, 0])[None, :, None, None] * (stress != 0)
    moved = np.stack([initial, initial + displacement])
    zero = np.zeros_like(moved)
    layout = ("snapshot", "particle", "dim")
    return {
        "snapshot_time": (("snapshot",), np.array([0.0, 1e-3]), {"units": "s"}),
        "position_initial": (("particle", "dim"), initial, {"units": "m"}),
        "position": (layout, moved, {"units": "m"}),
        "displacement": (layout, moved - initial, {"units": "m"}),
        "velocity": (layout, zero, {"units": "m/s"}),
        "stress": ((*layout, "dim2"), noisy, {"units": "Pa"}),
        "stress_exact": ((*layout, "dim2"), stress, {"units": "Pa"}),
    }


def make_quickstart(folder: Path, timing_context: str = "exclusive") -> None:
    """Five curves on the bar at 8 to 64 cells, one failed run and one that does not apply."""
    curves = [
        ("mpm", "linear", "lumped", 2.0, 7e-4),
        ("mpm", "bspline", "consistent", 3.0, 8e-5),
        ("otm", "linear", "consistent", 2.0, 1.6e-4),
        ("otm", "maxent", "consistent", 3.5, 6e-5),
        ("unified", "bspline", "consistent", 3.0, 9e-5),
    ]
    for method, basis, mass, order, constant in curves:
        for resolution in (8, 16, 32, 64):
            failed = (method, resolution) == ("unified", 64)
            make_run(
                folder,
                method,
                basis,
                resolution,
                mass=mass,
                order=order,
                constant=constant,
                timing_context=timing_context,
                status="broke_down" if failed else "ok",
                reason="particle 3 left the end knots at step 7 (t = 7e-05 s)" if failed else "",
            )
    make_run(
        folder,
        "gmm",
        "bspline",
        8,
        status="not_applicable",
        reason="gmm needs nodes of its own, bspline has knots",
    )


@pytest.fixture
def write_run() -> Callable[..., Path]:
    """The function `make_run`."""
    return make_run


@pytest.fixture
def only_svg(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports draw each figure in one format: for tests of what else is in them."""
    monkeypatch.setattr(writer, "FORMATS", {"svg": writer.FORMATS["svg"]})


@pytest.fixture
def write_quickstart() -> Callable[..., None]:
    """The function `make_quickstart`."""
    return make_quickstart
