"""Constitutive laws: one file per law.

A plug-in is a dataclass of its settings, registered with ``@register("material", name)``; its `law` is a NamedTuple of
numbers for which the file implements `cauchy_stress` and `energy_density`.
"""

from typing import Any, ClassVar, Protocol

import numpy as np


def cauchy_stress(
    law: Any, axes: Any, F: np.ndarray, L: np.ndarray, dt: float, state: np.ndarray, sigma: np.ndarray
) -> None:
    """Write the Cauchy stress [Pa] to `sigma`, shape (dim, dim), and the new history to `state`.

    Parameters
    ----------
    law : NamedTuple
        The material's numbers.
    axes : tuple
        As many entries as there are dimensions; the missing ones are in plane strain (F = 1).
    F, L : ndarray
        New deformation gradient and velocity gradient [1/s], shape (dim, dim).
    dt : float
        Time step [s].
    state : ndarray
        History variables of this particle.
    """
    raise NotImplementedError


def energy_density(law: Any, axes: Any, F: np.ndarray, state: np.ndarray) -> float:
    """Stored energy per reference volume [J/m^3]."""
    raise NotImplementedError


class Material(Protocol):
    """The registered dataclass: its fields are the keys of ``conf/material/<name>.yaml``."""

    density: float  # kg/m^3
    history: ClassVar[int]  # number of history variables per particle
    symmetric: ClassVar[bool]  # the Cauchy stress is symmetric and objective: angular momentum is conserved
    conserves_energy: ClassVar[bool]  # the work of the stress is stored

    @property
    def law(self) -> Any:
        """The NamedTuple that kernels take."""
        ...

    def lame_parameters(self) -> tuple[float, float]:
        """First Lame parameter and shear modulus [Pa] of the undeformed state; they bound the time step."""
        ...
