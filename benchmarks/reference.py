"""Bits of some seventy short runs, kept to see whether a change of the code changes results.

``python -m benchmarks reference --store`` writes them, ``--check`` computes them again and compares; with
``--only`` both take the runs that have a text in their name.
"""

import argparse
import hashlib
import json
from pathlib import Path
from typing import Any

import numba
import numpy as np

from mpmbench import case
from mpmbench.case.build import step_size
from mpmbench.case.output import outcome
from mpmbench.core.compiled import threads
from mpmbench.core.errors import SolverFailure
from mpmbench.core.simulation import Solution, simulate
from mpmbench.results.provenance import processor
from mpmbench.runs.hydra import compose

# What every run of a problem starts from: coarse, but particles cross cells, and strains are large.
SMALL = {
    "bar_fixed_ends": "resolution=8 particles_per_cell=4 time_step=2e-4 end_time=1"
    " problem.velocity_amplitude=6",
    "bar_dynamic_traction": "resolution=12 time_step=5e-3 end_time=1"
    " problem.traction_amplitude=-20",
    "elastic_bar_tension": "resolution=16 time_step=2e-7 problem.end_velocity=200",
    "prestretched_bar": "resolution=16 problem.velocity_noise=9e-4",
    "isothermal_shock": "resolution=12",
    "plate_axis_aligned": "resolution=5 particles_per_cell=4 time_step=2e-4 end_time=1"
    " problem.displacement_amplitude=0.05",
    "cantilever_self_weight": "resolution=16 problem.load_steps=2",
    "cantilever_dynamic": "resolution=8 time_step=1e-2 end_time=0.04",
    "rolling_disk": "resolution=6 problem.plane=nodes problem.travel=1 end_time=8e-3",
    "soil_column": "resolution=8 time_step=0.02 end_time=0.1 material.cohesion=1000"
    " method.residual_tolerance=1e-12",  # or what is left depends on the processor
    "patch_test": "resolution=4",
    "lme_shape_functions": "problem.samples_per_axis=9",
    "taylor_anvil": "resolution=2 end_time=4e-6",
    "colliding_disks": "resolution=12 time_step=5e-2 end_time=2.5",
}
# One run a line, named by it: problem, then overrides.
RUNS = """
bar_fixed_ends method=mpm basis=linear
bar_fixed_ends method=mpm basis=linear method.stress_update=usf material=neo_hookean
bar_fixed_ends method=mpm basis=linear method.stress_update=musl material=hencky_elastic
bar_fixed_ends method=mpm basis=linear method.transfer=pic
bar_fixed_ends method=mpm basis=linear method.transfer=blend method.flip=0.9
bar_fixed_ends method=mpm basis=linear method.transfer=position_difference
bar_fixed_ends method=mpm basis=linear time_step=auto cfl=3.0
bar_fixed_ends method=mpm basis=bspline basis.degree=1 method.mass=consistent
bar_fixed_ends method=mpm basis=bspline method.mass=consistent method.mass_cutoff=0
bar_fixed_ends method=mpm basis=bspline basis.degree=3 problem.particle_layout=gauss
bar_fixed_ends method=mpm basis=maxent basis.prior=quartic_spline basis.d_max=3
bar_fixed_ends method=mpm basis=maxent basis.prior=gaussian method.mass=consistent
bar_fixed_ends method=mpm basis=mls
bar_fixed_ends method=otm basis=maxent
bar_fixed_ends method=otm basis=maxent method.mass=lumped basis.search=all
bar_fixed_ends method=otm basis=linear method.mass=lumped method.transfer=nodal
bar_fixed_ends method=unified basis=bspline basis.degree=3 method.mass=lumped
bar_fixed_ends method=linear_fem method.shape_functions=frozen material=st_venant_kirchhoff
bar_fixed_ends method=linear_fem material=elastic_fluid
bar_dynamic_traction method=mpm basis=linear method.traction=last_particle
bar_dynamic_traction method=mpm basis=bspline method.mass=consistent
bar_dynamic_traction method=mpm basis=linear method.shape_functions=frozen
bar_dynamic_traction method=otm basis=maxent problem.traction_amplitude=-400
bar_dynamic_traction method=unified basis=bspline
elastic_bar_tension method=otm basis=lme problem.irregularity=0.3
elastic_bar_tension method=otm basis=lme basis.locality=volume
elastic_bar_tension method=sph problem.particle_layout=nodes
elastic_bar_tension method=sph problem.particle_layout=nodes method.derivatives=symmetric
prestretched_bar method=otm basis=lme
prestretched_bar method=otm basis=lme problem.particle_layout=nodes method.shape_functions=frozen
isothermal_shock method=otm basis=lme basis.gradient=consistent problem.irregularity=0.2
isothermal_shock method=unified basis=bspline particles_per_cell=2
isothermal_shock method=otm basis=lme basis.gradient=consistent problem.dimension=2
isothermal_shock method=otm basis=lme problem.dimension=3 resolution=5
isothermal_shock method=otm basis=mls problem.dimension=3 resolution=5
isothermal_shock method=linear_fem problem.dimension=3 resolution=5
plate_axis_aligned method=mpm basis=linear
plate_axis_aligned method=mpm basis=linear problem.body_force=false method.stress_update=musl
plate_axis_aligned method=mpm basis=bspline method.mass=consistent
plate_axis_aligned method=mpm basis=bspline basis.degree=3 method.transfer=pic
plate_axis_aligned method=mpm basis=maxent basis.d_max=3 method.mass=consistent
plate_axis_aligned method=otm basis=maxent basis.prior=gaussian
plate_axis_aligned method=otm basis=lme basis.rim=cut method.mass=lumped method.transfer=nodal
plate_axis_aligned method=otm basis=mls basis.weight=gaussian
plate_axis_aligned method=unified basis=bspline
cantilever_self_weight method=fem basis=linear
cantilever_self_weight method=implicit_mpm basis=linear method.ghost_stiffness=1e-6
cantilever_self_weight method=gmm basis=mls method.dirichlet=multipliers
cantilever_self_weight method=gmm basis=lme method.dirichlet=multipliers
cantilever_dynamic method=implicit_mpm basis=linear particles_per_cell=16
cantilever_dynamic method=gmm basis=lme method.shape_functions=frozen material=hencky_elastic
cantilever_dynamic method=mpm basis=linear method.stress_update=usf time_step=8e-4
rolling_disk method=implicit_mpm basis=linear problem.gap=0
rolling_disk method=gmm basis=mls problem.gap=0
soil_column method=implicit_mpm basis=linear
soil_column method=gmm basis=mls problem.initial_stress=k0
patch_test method=fem basis=linear
patch_test method=gmm basis=lme
lme_shape_functions basis=lme basis.locality=convected problem.metric_stretch=2
lme_shape_functions basis=maxent basis.tolerance=1e-5
taylor_anvil method=mpm basis=bspline
taylor_anvil method=mpm basis=bspline material=johnson_cook problem.friction=0.2 method.transfer=apic
taylor_anvil method=mpm basis=linear method.stress_update=musl material=thermo_viscoplastic
taylor_anvil method=mpm basis=bspline method.stress_update=usf method.transfer=fmpm
taylor_anvil method=otm basis=lme
taylor_anvil method=tlmpm basis=bspline problem.friction=0.5
colliding_disks method=mpm basis=linear contact=shared
colliding_disks method=mpm basis=linear contact=multi_field
colliding_disks method=mpm basis=bspline contact=penalty
""".strip().splitlines()
STEPS = 50  # at most; implicit runs and adaptive steps reach their end_time earlier
FIELDS = ("x", "v", "F", "sigma", "V", "state")
FIELD_OF_ERROR = {"displacement": "x", "velocity": "v", "stress": "sigma"}
ROWS = 100  # of a field that are kept
FOLDER = Path(__file__).parent
VALUES, DIGESTS = FOLDER / "reference.npz", FOLDER / "reference.json"


def overrides_of(run: str) -> list[str]:
    """Words of the command line; those of the run come last and win."""
    problem, *words = run.split()
    settings = dict(word.split("=", 1) for word in [*SMALL[problem].split(), *words])
    return [f"problem={problem}", *(f"{key}={value}" for key, value in settings.items())]


def compute(runs: list[str]) -> list[tuple[dict[str, np.ndarray], dict[str, Any]]]:
    """Final fields of each run, and its record; the only place that knows the program's inside."""
    results = []
    for run, (config, why_not) in zip(
        runs, compose.compose_many([overrides_of(run) for run in runs]), strict=True
    ):
        if why_not:
            raise SystemExit(f"{run}: {why_not}")
        plugins, state = case.read(config), None
        threads.use(1)
        try:
            state = case.build(plugins)
            time_step, end = (
                step_size(config, plugins, state),
                float(config["end_time"]),
            )
            if not callable(time_step):
                end = min(end, STEPS * time_step)
            solution = simulate(state, time_step, end)
        except SolverFailure as failure:
            solution = Solution(status=failure.status, reason=str(failure))
        fields = {}
        if state is not None:
            fields = {name: getattr(state.particles, name) for name in FIELDS}
            fields["nodes"] = state.basis.nodes
        data = outcome(config, plugins, state, solution, 0.0).variables
        errors = {
            name: float(data[name][1])
            for name in data
            if (name.startswith("error_") and name.endswith("_rms")) or name == "energy_drift"
        }
        content = b"".join(np.ascontiguousarray(field).tobytes() for field in fields.values())
        record = {"digest": hashlib.sha256(content).hexdigest(), "status": solution.status}
        results.append((fields, record | {"reason": solution.reason, "errors": errors}))
    return results


def kept(field: np.ndarray) -> np.ndarray:
    """Some rows of a field, and a weighted sum of all that shows a change of the rows left out."""
    rows = field.reshape(len(field), -1)
    weights = np.cos(np.arange(len(rows)))[:, None] / max(len(rows), 1)
    return np.vstack([rows[:: -(-len(rows) // ROWS) or 1], (weights * rows).sum(axis=0)])


def store(only: str) -> int:
    """Write both files; runs without this text in their name are kept as they were."""
    values, records = {}, []
    chosen = [run for run in RUNS if only in run]
    found = dict(zip(chosen, compute(chosen), strict=True))
    old_values = np.load(VALUES) if only else {}
    old = json.loads(DIGESTS.read_text())["runs"] if only else []
    place = {record["name"]: k for k, record in enumerate(old)}
    for run in RUNS:
        here = f"{len(records)} "
        if run in found:
            fields, record = found[run]
            values |= {here + name: kept(field) for name, field in fields.items()}
            records.append({"name": run, "overrides": overrides_of(run)} | record)
        elif run in place:
            there = f"{place[run]} "
            names = [key for key in old_values if key.startswith(there)]
            values |= {here + key.removeprefix(there): old_values[key] for key in names}
            records.append(old[place[run]])
    np.savez_compressed(VALUES, **values)  # type: ignore[arg-type]
    head = {"processor": processor(), "numpy": np.__version__, "numba": numba.__version__}
    DIGESTS.write_text(json.dumps(head | {"runs": records}, indent=1) + "\n")
    print(f"{len(found)} of {len(records)} runs stored")
    return 0


def tolerance_of(run: str, old: dict[str, Any]) -> float:
    """What rounding may do to a field, relative to its largest value.

    Newton's iteration stops anywhere below its tolerance, plastic steps switch, and whatever grows
    until it fails has grown from rounding. So does the iteration for consistent gradients, at 1e-6 of
    their sums: with 1e-12 in its place the shock in two dimensions changes by 3e-7 of its stress.
    """
    if "basis.gradient=consistent" in run:
        return 1e-7
    sensitive = any(f"method={name}" in run for name in ("fem", "gmm", "implicit_mpm"))
    return 1e-8 if sensitive or run.startswith("soil_column") or old["status"] != "ok" else 1e-12


def distance(old: np.ndarray | None, new: np.ndarray | None) -> float:
    """Largest difference over the largest finite value; inf where shapes or nans differ."""
    if old is None or new is None or old.shape != new.shape:
        return np.inf
    finite = np.isfinite(old)
    if not np.array_equal(old[~finite], new[~finite], equal_nan=True):
        return np.inf
    largest = float(np.abs(new - old, where=finite, out=np.zeros(old.shape)).max(initial=0.0))
    return largest / (np.abs(old[finite]).max(initial=0.0) or 1.0)


def differences(old: dict[str, Any], new: dict[str, Any]) -> str:
    """How status and printed errors differ: in the fourth digit, and by more than 1e-13 of the field; "" if not."""
    if old["status"] != new["status"]:
        return f"status {old['status']} -> {new['status']} ({new['reason']})"
    found = []
    for name in sorted({*old["errors"], *new["errors"]}):
        a, b = old["errors"].get(name, np.nan), new["errors"].get(name, np.nan)
        if not (np.isclose(a, b, rtol=5e-5, atol=1e-13, equal_nan=True)):
            found.append(f"{name} {a:.4g} -> {b:.4g}")
    return ", ".join(found)


def check(only: str) -> int:
    """Compute the runs again and say which differ; the exit code is 1 when one differs in more than rounding."""
    stored = json.loads(DIGESTS.read_text())
    if stored["processor"] != processor():
        print(f"stored on {stored['processor']}: here only the tolerance counts, not the bits")
    values = np.load(VALUES)
    chosen = [k for k, record in enumerate(stored["runs"]) if only in record["name"]]
    same, close = 0, 0
    results = compute([stored["runs"][k]["name"] for k in chosen])
    for k, (fields, new) in zip(chosen, results, strict=True):
        old = stored["runs"][k]
        if old["digest"] == new["digest"] and not differences(old, new):
            same += 1
            continue
        names = {key.split()[1] for key in values.files if key.split()[0] == str(k)} | set(fields)
        off = {
            name: distance(
                values[f"{k} {name}"] if f"{k} {name}" in values.files else None,
                kept(fields[name]) if name in fields else None,
            )
            for name in sorted(names)
        }
        errors = differences(old, new)
        fine = max(off.values()) <= tolerance_of(old["name"], old) and not errors
        close += fine
        largest = ", ".join(f"{name} {value:.1e}" for name, value in off.items() if value)
        print(f"{'close' if fine else 'DIFFERS'}: {old['name']}: {largest}; {errors}")
    differ = len(chosen) - same - close
    print(
        f"{same} of {len(chosen)} bitwise the same, {close} within rounding of the field, "
        f"{differ} differ"
    )
    return 1 if differ else 0


def main(arguments: list[str]) -> int:
    """``reference --store`` or ``reference --check``, each with ``[--only SUBSTRING]``."""
    parser = argparse.ArgumentParser(prog=f"python -m {__package__} reference")
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--store", action="store_true", help="compute and keep all runs")
    action.add_argument("--check", action="store_true", help="compute again and compare")
    parser.add_argument("--only", default="", help="runs with this text in their name")
    options = parser.parse_args(arguments)
    return store(options.only) if options.store else check(options.only)
