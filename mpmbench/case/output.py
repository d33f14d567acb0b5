"""From a solution to the dataset that a result file holds: scalars, histories, snapshots and errors, with units."""

from collections.abc import Callable
from functools import partial

import numpy as np
import xarray as xr

from mpmbench.analysis.norms import error_norms
from mpmbench.case.read import Case, Config
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State

UNITS = {"displacement": "m", "velocity": "m s-1", "stress": "Pa"}


def dataset(
    config: Config, case: Case, state: State | None, solution: Solution, compile_time: float
) -> xr.Dataset:
    """All that a run has to say, as one dataset with units."""
    out = measured(state, solution, compile_time)
    step = out.attrs["time_step"] if solution.time_step > 0.0 else str(config["time_step"])
    out.attrs |= {
        **{kind: config[kind]["name"] for kind in ("problem", "method", "basis", "material")},
        "mass": case.choices.mass,
        "resolution": case.resolution,
        "time_step": step,
        "particles_per_cell": case.particles_per_cell,
    }
    if state is None:
        return out
    X = state.particles.X[state.particles.material]
    _add_exact(out, case, X, solution)
    if solution.status == "ok":
        scalar = partial(_add_scalar, out)
        _add_errors(case, X, solution, scalar)
        floor = case.problem.temporal_floor(
            solution.time_step, solution.time_reached, X, case.material
        )
        text = "displacement error of the time integration alone, predicted"
        scalar("predicted_temporal_floor", floor, "m", text)
    for name, (value, unit, text, *dims) in case.problem.quantities(
        solution, case.material
    ).items():
        default = ("time",) if np.ndim(value) else ()
        out[name] = (dims[0] if dims else default, value, {"units": unit, "long_name": text})
    return out


def measured(state: State | None, solution: Solution, compile_time: float) -> xr.Dataset:
    """What a solution says by itself, whatever the problem: scalars, histories and snapshots."""
    attributes = {"status": solution.status, "reason": solution.reason}
    out = xr.Dataset(attrs=attributes | {"time_step": solution.time_step})
    scalar = partial(_add_scalar, out)
    scalar("steps", solution.steps, "1", "number of time steps done")
    scalar("time_reached", solution.time_reached, "s", "simulated time reached")
    scalar("solver_time", solution.solver_time, "s", "time in the time steps")
    scalar("compile_time", compile_time, "s", "time for set-up and compiling")
    if state is None:
        return out
    text = "number of nodes (degrees of freedom per component)"
    scalar("n_nodes", len(state.basis.nodes), "1", text)
    particles = state.particles.material.stop
    scalar("n_particles", particles, "1", "number of particles with mass")
    for name, (value, unit, text) in state.basis.statistics().items():
        scalar(name, value, unit, text)
    text = "number of times a particle has changed its grid cell"
    scalar("n_cell_crossings", solution.cell_crossings, "1", text)
    _add_history(out, solution, scalar)
    _add_records(out, solution)
    _add_snapshots(out, state, solution)
    return out


def _add_scalar(
    out: xr.Dataset, name: str, value: float | int | None, unit: str, text: str
) -> None:
    if value is not None:
        out[name] = ((), value, {"units": unit, "long_name": text})


def _add_history(out: xr.Dataset, solution: Solution, scalar: Callable[..., None]) -> None:
    history = {name: np.array(values) for name, values in solution.history.items()}
    out.coords["time"] = ("time", history["time"], {"units": "s", "long_name": "time"})
    for name, unit, dims in (
        ("kinetic_energy", "J", ("time",)),
        ("strain_energy", "J", ("time",)),
        ("external_work", "J", ("time",)),
        ("momentum", "kg m s-1", ("time", "dim")),
        ("angular_momentum", "kg m2 s-1", ("time", "axis")),
    ):
        out[name] = (dims, history[name], {"units": unit, "long_name": name.replace("_", " ")})
    kinetic, energy = (
        history["kinetic_energy"],
        history["kinetic_energy"] + history["strain_energy"],
    )
    balance = np.abs(energy - history["external_work"] - energy[0])
    scale = max(energy[0], kinetic.max())
    scalar(
        "energy_drift",
        balance.max() / scale if scale > 0.0 else np.nan,
        "1",
        "largest |kinetic + strain - external work - initial energy| over max(initial energy, largest kinetic)",
    )
    drift = np.linalg.norm(history["momentum"] - history["momentum"][0], axis=1)
    scalar("momentum_drift", drift.max(), "kg m s-1", "largest change of total momentum")


def _add_records(out: xr.Dataset, solution: Solution) -> None:
    """What the time loop noted about each step; lists of different lengths are padded with nan."""
    for name, row_dim, dim, unit, text in (
        (
            "newton_residual",
            "tried",
            "iteration",
            "1",
            "residual of Newton's iteration relative to the external force",
        ),
        ("reaction", "solved", "dim", "N", "sum of the forces that hold the constrained nodes"),
    ):
        rows = solution.records.get(name)
        if rows:
            table = np.full((len(rows), max(len(row) for row in rows)), np.nan)
            for step, row in enumerate(rows):
                table[step, : len(row)] = row
            out[name] = ((row_dim, dim), table)
            out[name].attrs = {"units": unit, "long_name": text}
    if "newton_residual" in solution.records:
        for name, record, text in (
            (
                "stiffened_steps",
                "stiffened_at",
                "number of steps that converged with a stiffer tangent only",
            ),
            (
                "halved_steps",
                "halved_at",
                "number of steps that did not converge and were done in two halves",
            ),
        ):
            out[name] = (
                (),
                len(solution.records.get(record, [])),
                {"units": "1", "long_name": text},
            )


def _add_snapshots(out: xr.Dataset, state: State, solution: Solution) -> None:
    p = state.particles
    keep, X = p.material, p.X[p.material]
    shots = solution.snapshots
    times = np.array([shot["time"] for shot in shots])
    out.coords["snapshot_time"] = (
        "snapshot",
        times,
        {"units": "s", "long_name": "time of the snapshot"},
    )
    out["position_initial"] = (
        ("particle", "dim"),
        X,
        {"units": "m", "long_name": "initial position"},
    )
    vector, tensor = ("snapshot", "particle", "dim"), ("snapshot", "particle", "dim", "dim2")
    position = np.array([shot["x"][keep] for shot in shots])
    computed = {
        "position": (vector, position, "m"),
        "displacement": (vector, position - X, "m"),
        "velocity": (vector, np.array([shot["v"][keep] for shot in shots]), "m s-1"),
        "stress": (tensor, np.array([shot["sigma"][keep] for shot in shots]), "Pa"),
        "volume": (
            ("snapshot", "particle"),
            np.array([shot["V"][keep] for shot in shots]),
            f"m{p.dimension}",
        ),
    }
    for name, (dims, values, unit) in computed.items():
        out[name] = (dims, values, {"units": unit, "long_name": name})
    for name, (column, unit, text) in state.material.outputs.items():
        values = np.array([shot["state"][keep, column] for shot in shots])
        out[name] = (("snapshot", "particle"), values, {"units": unit, "long_name": text})
    for name, declared in p.declared.items():
        axes = [
            ("dim", "dim2")[declared.axes[:k].count("dim")] if axis == "dim" else f"{name}_{k}"
            for k, axis in enumerate(declared.axes)
        ]
        values = np.array([shot[name][keep] for shot in shots])
        out[name] = (("snapshot", "particle", *axes), values)
        out[name].attrs = {"units": declared.unit, "long_name": declared.says}


def _add_exact(out: xr.Dataset, case: Case, X: np.ndarray, solution: Solution) -> None:
    """Exact fields at the instants of the snapshots, where the problem knows them."""
    times, half = out.snapshot_time.values, _velocity_lag(case, solution)
    exact = [_exact(case, X, t, half if t > 0.0 else 0.0) for t in times]
    for name, unit in UNITS.items():
        parts = [fields.get(name) for fields in exact]
        if all(part is not None for part in parts):
            out[f"{name}_exact"] = (out[name].dims, np.array(parts))
            out[f"{name}_exact"].attrs = {"units": unit, "long_name": f"exact {name}"}


def _velocity_lag(case: Case, solution: Solution) -> float:
    """How much earlier than positions velocities live [s]."""
    return case.choices.velocity_lag * solution.time_step


def _exact(case: Case, X: np.ndarray, t: float, half_step: float) -> dict[str, np.ndarray]:
    """Exact fields at t, the velocity half a step earlier, where that of the leapfrog scheme lives."""
    exact = dict(case.problem.exact(X, t, case.material))
    if "velocity" in exact:
        exact["velocity"] = case.problem.exact(X, t - half_step, case.material)["velocity"]
    return exact


def _add_errors(case: Case, X: np.ndarray, solution: Solution, scalar: Callable[..., None]) -> None:
    last, t = solution.snapshots[-1], solution.time_reached
    n = len(X)
    computed = {
        "displacement": last["x"][:n] - X,
        "velocity": last["v"][:n],
        "stress": last["sigma"][:n],
    }
    references = {"": _exact(case, X, t, _velocity_lag(case, solution))}
    references["_alternative"] = case.problem.alternative(X, t, case.material)
    for suffix, exact in references.items():
        for name, reference in exact.items():
            error, relative = error_norms(computed[name], reference)
            text = f"root mean square error of the {name}" + (
                " against the second reference" if suffix else ""
            )
            scalar(f"error_{name}_rms{suffix}", error, UNITS[name], text)
            scalar(
                f"error_{name}_relative{suffix}", relative, "1", text + ", relative to the field"
            )
        if not suffix and "stress" in exact and X.shape[1] > 1:
            error, relative = error_norms(computed["stress"][:, 0, 0], exact["stress"][:, 0, 0])
            scalar(
                "error_stress_11_rms",
                error,
                "Pa",
                "root mean square error of the normal stress along x_1",
            )
            scalar("error_stress_11_relative", relative, "1", "the same, relative to the field")
