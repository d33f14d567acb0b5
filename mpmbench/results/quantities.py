"""What every run has, and what is a run's own: the quantities of interest of its problem."""

from collections.abc import Iterable

ERRORS = ("displacement", "velocity", "stress", "stress_11")
ENDS = ("rms", "relative", "rms_alternative", "relative_alternative")
COMMON = {
    *("steps", "time_reached", "solver_time", "solver_cpu_time", "compile_time", "wall_time"),
    *("peak_memory", "n_particles", "n_nodes", "n_cell_crossings", "predicted_temporal_floor"),
    *("energy_drift", "energy_imbalance", "momentum_drift", "stiffened_steps", "halved_steps"),
    *(f"error_{name}_{end}" for name in ERRORS for end in ENDS),
}
ENERGIES = (
    *("kinetic_energy", "strain_energy", "dissipated_energy", "numerical_dissipation"),
    *("contact_energy", "external_work"),
)
OF_BASES = {  # what bases say of a run
    *("newton_steps_mean", "newton_steps_max", "enlarged_points", "neighbours_mean", "plain_cells"),
}
ZERO_FIELD = 1e6  # a relative error from here on is that of a field that is zero up to round-off


def own(names: Iterable[str]) -> list[str]:
    """Those scalars or histories that not every run has.

    >>> own(["steps", "final_run_out", "kinetic_energy", "plain_cells"])
    ['final_run_out', 'plain_cells']
    """
    return [name for name in names if name not in COMMON and name not in ENERGIES]


def of_interest(names: Iterable[str]) -> list[str]:
    """Those that are the problem's: the quantities it is about.

    >>> of_interest(["steps", "final_run_out", "kinetic_energy", "plain_cells"])
    ['final_run_out']
    """
    return [name for name in own(names) if name not in OF_BASES]
