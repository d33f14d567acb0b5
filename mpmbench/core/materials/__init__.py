"""Constitutive laws: one file per law.

A plug-in is a dataclass of its settings, registered with ``@register("material", name)``; its `law`
is a NamedTuple of numbers for which the file implements `cauchy_stress` and `energy_density`.
"""

from typing import Any, ClassVar, Protocol

import numpy as np


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


def energy_density(law: Any, axes: Any, F: np.ndarray, state: np.ndarray) -> float:
    """Stored energy per reference volume [J/m^3]."""
    raise NotImplementedError


class Material(Protocol):
    """The registered dataclass: its settings are the keys of the material.

    It may have ``particle_data``, a dict of `ParticleData`, for arrays in ``particles.data``.
    """

    density: float  # kg/m^3
    history: ClassVar[int]  # number of history variables per particle
    rate_dependent: ClassVar[
        bool
    ]  # the stress depends on the velocity gradient, which is then kept per particle
    symmetric: ClassVar[
        bool
    ]  # the Cauchy stress is symmetric and objective: angular momentum is conserved
    conserves_energy: ClassVar[bool]  # the work of the stress is stored
    symmetric_tangent: Any  # the moduli have major symmetry (bool)

    @property
    def law(self) -> Any:
        """The NamedTuple that kernels take."""
        ...

    def lame_parameters(self) -> tuple[float, float]:
        """First Lame parameter and shear modulus [Pa] of the undeformed state; they bound the time step."""
        ...
