"""From a solution to all that a result file holds: scalars, histories, snapshots and errors, with units."""

from collections.abc import Hashable
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from mpmbench.analysis.norms import error_norms
from mpmbench.case.read import Case, Config
from mpmbench.core.end_state import as_numbers
from mpmbench.core.materials.fields import derived_fields
from mpmbench.core.simulation import Solution
from mpmbench.core.state import State

if TYPE_CHECKING:
    import xarray as xr

END_STATE = "end_state"  # variables whose name begins so are for continuing a run
COORDINATES = ("time", "snapshot_time")
# Variables by name: dimensions, values and labels, as xarray takes them.
Variables = dict[str, tuple[Any, ...]]
UNITS = {"displacement": "m", "velocity": "m s-1", "stress": "Pa"}


@dataclass
class Outcome:
    """All that a run has to say.

    Attributes
    ----------
    variables : dict
        By name: dimensions, values and labels.
    attrs : dict
        What else is known, how the run ended among it.
    """

    variables: Variables
    attrs: dict[str, Any]

    def as_dataset(self) -> "xr.Dataset":
        """The same for a user. A run does without: to import xarray takes a third of a second."""
        import xarray as xr

        coordinates = {name: self.variables[name] for name in COORDINATES if name in self.variables}
        data = {name: one for name, one in self.variables.items() if name not in coordinates}
        return xr.Dataset(data, coordinates, self.attrs)


def labelled(
    dims: str | tuple[Hashable, ...], values: Any, unit: str, text: str
) -> tuple[Any, ...]:
    """A variable with its unit and long name."""
    return dims, values, {"units": unit, "long_name": text}


def scalar(value: float, unit: str, text: str) -> tuple[Any, ...]:
    """A number with its unit and long name."""
    return labelled((), value, unit, text)


def outcome(
    config: Config, case: Case, state: State | None, solution: Solution, compile_time: float
) -> Outcome:
    """All that a run has to say, with units."""
    out = _measured(state, solution, compile_time)
    step = solution.time_step if solution.time_step > 0.0 else str(config["time_step"])
    attributes = {
        **{kind: config[kind]["name"] for kind in ("problem", "method", "basis", "material")},
        "mass": case.choices.mass,
        "resolution": case.resolution,
        "time_step": step,
        "particles_per_cell": case.particles_per_cell,
    }
    if state is not None:
        _add_problem(out, case, state, solution)
    return _together(out, solution, attributes)


def _together(out: Variables, solution: Solution, attributes: dict[str, Any]) -> Outcome:
    """All variables, with how the run ended."""
    said = {"status": solution.status, "reason": solution.reason, "time_step": solution.time_step}
    return Outcome(out, said | attributes)


def _add_problem(out: Variables, case: Case, state: State, solution: Solution) -> None:
    """What the problem knows of the solution: exact fields, errors and its own quantities."""
    problem, X = case.problem, state.particles.X[state.particles.material]
    _add_exact(out, case, X, solution)
    if solution.status == "ok":
        _add_errors(out, case, X, solution)
        floor = problem.temporal_floor(solution.time_step, solution.time_reached, X, case.material)
        if floor is not None:
            text = "displacement error of the time integration alone, predicted"
            out["predicted_temporal_floor"] = scalar(floor, "m", text)
    for name, (value, unit, text, *dims) in problem.quantities(solution, case.material).items():
        default = ("time",) if np.ndim(value) else ()
        if default or solution.status == "ok" or name in problem.known_early:
            out[name] = labelled(dims[0] if dims else default, value, unit, text)
    _add_end_state(out, solution)


def measured(state: State | None, solution: Solution, compile_time: float) -> Outcome:
    """What a solution says by itself, whatever the problem: scalars, histories and snapshots."""
    return _together(_measured(state, solution, compile_time), solution, {})


def _measured(state: State | None, solution: Solution, compile_time: float) -> Variables:
    out = {
        "steps": scalar(solution.steps, "1", "number of time steps done"),
        "time_reached": scalar(solution.time_reached, "s", "simulated time reached"),
        "solver_time": scalar(solution.solver_time, "s", "time in the time steps"),
        "solver_cpu_time": scalar(solution.solver_cpu_time, "s", "CPU time in the time steps"),
        "compile_time": scalar(compile_time, "s", "time for set-up and compiling"),
    }
    if state is None:
        return out
    text = "number of nodes (degrees of freedom per component)"
    out["n_nodes"] = scalar(len(state.basis.nodes), "1", text)
    particles = state.particles.material.stop
    out["n_particles"] = scalar(particles, "1", "number of particles with mass")
    for name, said in state.basis.statistics().items():
        out[name] = scalar(*said)
    text = "number of times a particle has changed its grid cell"
    out["n_cell_crossings"] = scalar(solution.cell_crossings, "1", text)
    _add_history(out, state, solution)
    _add_records(out, solution)
    _add_snapshots(out, state, solution)
    return out


def _add_history(out: Variables, state: State, solution: Solution) -> None:
    history = {name: np.array(values) for name, values in solution.history.items()}
    out["time"] = labelled("time", history["time"], "s", "time")
    for name, unit, *axes in (
        ("kinetic_energy", "J"),
        ("strain_energy", "J"),
        ("dissipated_energy", "J"),
        ("numerical_dissipation", "J"),
        ("contact_energy", "J"),
        ("external_work", "J"),
        ("momentum", "kg m s-1", "dim"),
        ("angular_momentum", "kg m2 s-1", "axis"),
    ):
        out[name] = labelled(("time", *axes), history[name], unit, name.replace("_", " "))
    _add_bodies(out, state, history)
    kinetic = history["kinetic_energy"]
    energy = kinetic + history["strain_energy"] + history["dissipated_energy"]
    change = energy + history["contact_energy"] - history["external_work"] - energy[0]
    scale = max(energy[0], kinetic.max())
    terms = "kinetic + strain + dissipated + contact - external work - initial energy"
    for name, left, text in (
        ("energy_drift", change, terms),
        (
            "energy_imbalance",
            change + history["numerical_dissipation"],
            f"{terms} + numerical dissipation",
        ),
    ):
        out[name] = scalar(
            np.abs(left).max() / scale if scale > 0.0 else np.nan,
            "1",
            f"largest |{text}| over max(initial energy, largest kinetic)",
        )
    drift = np.linalg.norm(history["momentum"] - history["momentum"][0], axis=1).max()
    out["momentum_drift"] = scalar(drift, "kg m s-1", "largest change of total momentum")


def _add_bodies(out: Variables, state: State, history: dict[str, np.ndarray]) -> None:
    """Momenta and energies of each body, and whose the particles are, when there are several."""
    if state.bodies.count < 2:
        return
    owner = state.bodies.particle[state.particles.material]
    out["body"] = labelled("particle", owner + 1, "1", "number of the body of a particle")
    for name, unit, *axes in (
        ("body_momentum", "kg m s-1", "dim"),
        ("body_angular_momentum", "kg m2 s-1", "axis"),
        ("body_kinetic_energy", "J"),
        ("body_vibration_energy", "J"),
        ("body_strain_energy", "J"),
        ("body_dissipated_energy", "J"),
    ):
        text = f"{name.removeprefix('body_').replace('_', ' ')} of each body"
        out[name] = labelled(("time", "bodies", *axes), history[name], unit, text)


def _add_records(out: Variables, solution: Solution) -> None:
    """What the time loop noted about each step; lists of different lengths are padded with nan."""
    residual = "residual of Newton's iteration relative to the external force"
    for name, dims, unit, text in (
        ("newton_residual", ("tried", "iteration"), "1", residual),
        ("reaction", ("solved", "dim"), "N", "sum of the forces that hold the constrained nodes"),
    ):
        rows = solution.records.get(name)
        if rows:
            table = np.array([*zip_longest(*rows, fillvalue=np.nan)]).T
            out[name] = labelled(dims, table, unit, text)
    if "newton_residual" in solution.records:
        for kind, text in (
            ("stiffened", "number of steps that converged with a stiffer tangent only"),
            ("halved", "number of steps that did not converge and were done in two halves"),
        ):
            number = len(solution.records.get(f"{kind}_at", []))
            out[f"{kind}_steps"] = scalar(number, "1", text)


def _add_snapshots(out: Variables, state: State, solution: Solution) -> None:
    p, shots = state.particles, solution.snapshots
    keep, X = p.material, p.X[p.material]

    def kept(name: str) -> np.ndarray:
        return np.array([shot[name][keep] for shot in shots])

    times = np.array([shot["time"] for shot in shots])
    out["snapshot_time"] = labelled("snapshot", times, "s", "time of the snapshot")
    out["position_initial"] = labelled(("particle", "dim"), X, "m", "initial position")
    each, position = ("snapshot", "particle"), kept("x")
    for name, axes, values, unit in (
        ("position", ("dim",), position, "m"),
        ("displacement", ("dim",), position - X, "m"),
        ("velocity", ("dim",), kept("v"), "m s-1"),
        ("stress", ("dim", "dim2"), kept("sigma"), "Pa"),
        ("deformation_gradient", ("dim", "dim2"), kept("F"), "1"),
        ("volume", (), kept("V"), f"m{p.dimension}"),
    ):
        out[name] = labelled((*each, *axes), values, unit, name.replace("_", " "))
    derived = [derived_fields(state.material, shot) for shot in shots]
    for name, (_, unit, text) in derived[0].items():
        values = np.array([fields[name][0][keep] for fields in derived])
        out[name] = labelled(each, values, unit, text)
    for name, declared in p.declared.items():
        own = [
            ("dim", "dim2")[declared.axes[:k].count("dim")] if axis == "dim" else f"{name}_{k}"
            for k, axis in enumerate(declared.axes)
        ]
        out[name] = labelled((*each, *own), kept(name), declared.unit, declared.says)


def _add_end_state(out: Variables, solution: Solution) -> None:
    """What the command ``continue`` goes on from; no other reader of a result sees it."""
    if solution.end_state is None:
        return
    row, told = as_numbers(solution.end_state())
    text = np.frombuffer(told.encode(), dtype=np.uint8)
    for name, values, says in (
        ("", row, "all numbers of the simulation at its end"),
        ("_places", text, "what these numbers are, as JSON"),
    ):
        name = END_STATE + name
        out[name] = labelled(f"{name}_size", values, "", says)


def _add_exact(out: Variables, case: Case, X: np.ndarray, solution: Solution) -> None:
    """Exact fields at the instants of the snapshots, where the problem knows them."""
    exact = [_exact(case, X, t, solution) for t in out["snapshot_time"][1]]
    for name, unit in UNITS.items():
        parts = [fields.get(name) for fields in exact]
        if all(part is not None for part in parts):
            out[f"{name}_exact"] = labelled(out[name][0], np.array(parts), unit, f"exact {name}")


def _exact(case: Case, X: np.ndarray, t: float, solution: Solution) -> dict[str, np.ndarray]:
    """Exact fields at t, the velocity where that of the loop lives, which may be half a step earlier."""
    exact = dict(case.problem.exact(X, t, case.material))
    if "velocity" in exact and t > 0.0:
        lag = case.choices.velocity_lag * solution.time_step
        exact["velocity"] = case.problem.exact(X, t - lag, case.material)["velocity"]
    return exact


def _add_errors(out: Variables, case: Case, X: np.ndarray, solution: Solution) -> None:
    n, last, t = len(X), solution.snapshots[-1], solution.time_reached
    computed = {
        "displacement": last["x"][:n] - X,
        "velocity": last["v"][:n],
        "stress": last["sigma"][:n],
    }
    second = case.problem.alternative(X, t, case.material)
    for suffix, against, exact in (
        ("", "", _exact(case, X, t, solution)),
        ("_alternative", " against the second reference", second),
    ):
        for name, reference in exact.items():
            error, relative = error_norms(computed[name], reference)
            text = f"root mean square error of the {name}{against}"
            out[f"error_{name}_rms{suffix}"] = scalar(error, UNITS[name], text)
            text += ", relative to the field"
            out[f"error_{name}_relative{suffix}"] = scalar(relative, "1", text)
        if not suffix and "stress" in exact and X.shape[1] > 1:
            error, relative = error_norms(computed["stress"][:, 0, 0], exact["stress"][:, 0, 0])
            text = "root mean square error of the normal stress along x_1"
            out["error_stress_11_rms"] = scalar(error, "Pa", text)
            text = "the same, relative to the field"
            out["error_stress_11_relative"] = scalar(relative, "1", text)
