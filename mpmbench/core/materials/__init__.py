"""Constitutive laws: one file per law.

A plug-in is a dataclass of its settings, derived from `Material` and registered with
``@register("material", name)``; its `law` is a NamedTuple of numbers for which the file implements
`energy_density` and `cauchy_stress` or, for implicit methods, `kirchhoff_stress`. An elastic law
may give `elastic.elastic_stress` and `elastic.elastic_moduli` instead of both stresses, a plastic
one needs `plastic.return_map`, or `plastic.radial.hardening`, and nothing else.
"""

from typing import Any, ClassVar

import numpy as np

from mpmbench.core.compiled import answers_by_default
from mpmbench.core.particles import ParticleData
from mpmbench.core.setting import Settings

Fields = dict[str, tuple[np.ndarray, str, str]]  # values, unit and what it is, by name


def cauchy_stress(
    law: Any,
    axes: Any,
    F: np.ndarray,
    L: np.ndarray,
    dt: float,
    state: np.ndarray,
    sigma: np.ndarray,
) -> None:
    """Write the Cauchy stress [Pa] to `sigma`, shape (dim, dim), and the new history to `state`.

    Parameters
    ----------
    law : NamedTuple
        The material's numbers.
    axes : tuple
        As many entries as there are dimensions; the missing ones are in plane strain (F = 1).
    F, L : ndarray
        New deformation gradient and velocity gradient [1/s] (zero unless `rate_dependent`), shape
        (dim, dim).
    dt : float
        Time step [s].
    state : ndarray
        History variables of this particle.
    """
    raise NotImplementedError


@answers_by_default
def strain_all(law, axes, fields, first, dt, F, V, state, sigma, n):
    """Strain n particles of a batch, F to ``(I + dt L) F`` and V, and write stresses and histories as `cauchy_stress`.

    That is for laws that do so in vectors by themselves; the others return False and do nothing.
    `F` and `sigma` have a row for each entry of a matrix, ``d dim + e``, and so has `fields` from
    row `first` on, with the velocity gradients; the histories `state` have the shape (n, history).
    """
    return False


def kirchhoff_stress(
    law: Any,
    axes: Any,
    increment: np.ndarray,
    F: np.ndarray,
    old: np.ndarray,
    state: np.ndarray,
    tau: np.ndarray,
    moduli: np.ndarray,
) -> None:
    """Write the Kirchhoff stress [Pa], its spatial moduli [Pa] and the new history.

    The moduli are those of the first Piola-Kirchhoff stress pushed forward, ``dP F^T = a : grad
    du``, so that ``a_icjd = c_icjd + delta_ij tau_cd`` with the moduli c of the Lie derivative of
    tau; the geometric part is in them.

    Parameters
    ----------
    law, axes
        As in `cauchy_stress`.
    increment, F : ndarray
        Deformation gradients of the step and in total, shape (dim, dim).
    old, state : ndarray
        History at the start of the step, which stays as it is, and at this iterate.
    tau, moduli : ndarray
        Written; shapes (dim, dim) and (dim, dim, dim, dim).
    """
    raise NotImplementedError


@answers_by_default
def kirchhoff_step(
    law: Any,
    axes: Any,
    increment: np.ndarray,
    F: np.ndarray,
    dt: float,
    old: np.ndarray,
    state: np.ndarray,
    tau: np.ndarray,
    moduli: np.ndarray,
) -> None:
    """`kirchhoff_stress` after a step of the time `dt` [s], for laws in which time counts; infinite in statics."""
    kirchhoff_stress(law, axes, increment, F, old, state, tau, moduli)


def energy_density(law: Any, axes: Any, F: np.ndarray, state: np.ndarray) -> float:
    """Stored energy per reference volume [J/m^3]."""
    raise NotImplementedError


class Material(Settings):
    """Base of the registered dataclasses, whose settings are the keys of the material.

    Attributes
    ----------
    density : float
        Initial density [kg/m^3].
    history : int
        Number of history variables per particle.
    dissipated : int or None
        Column of the history with the work that is lost so far, per reference volume [J/m^3].
    outputs : dict
        Columns of the history that results keep, by name: column, unit, what it is.
    particle_data : dict of ParticleData
        Further arrays per particle, which stand in ``particles.data``.
    rate_dependent : bool
        The stress depends on the velocity gradient, which is then kept per particle.
    symmetric : bool
        The Cauchy stress is symmetric and objective: angular momentum is conserved.
    conserves_energy : bool
        The work of the stress is stored.
    symmetric_tangent : bool
        The moduli have major symmetry.
    """

    density: float
    history: ClassVar[int] = 0
    dissipated: ClassVar[int | None] = None
    outputs: ClassVar[dict[str, tuple[int, str, str]]] = {}
    particle_data: ClassVar[dict[str, ParticleData]] = {}
    rate_dependent: ClassVar[bool] = False
    symmetric: ClassVar[bool] = True
    conserves_energy: ClassVar[bool] = True
    symmetric_tangent: ClassVar[bool] = True

    @property
    def law(self) -> Any:
        """The NamedTuple that kernels take."""
        raise NotImplementedError

    def fields(self, state: np.ndarray) -> Fields:
        """What results keep of histories, shape (..., history); shapes (...)."""
        return {
            name: (state[..., column], unit, text)
            for name, (column, unit, text) in self.outputs.items()
        }

    def lame_parameters(self) -> tuple[float, float]:
        """First Lame parameter and shear modulus [Pa] at rest, which bound the time step."""
        raise NotImplementedError
