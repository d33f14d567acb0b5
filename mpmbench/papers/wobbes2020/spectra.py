"""Stability limits on an infinite grid, from the symbols of mass and stiffness of B-splines."""

import numpy as np

# Values at the integers of the B-splines of degree 1, 3, 5 and 7 (degree 1 first), from the middle
# outwards.
AT_INTEGERS = {1: (1.0,), 3: (4 / 6, 1 / 6), 5: (66 / 120, 26 / 120, 1 / 120)}
AT_INTEGERS[7] = (2416 / 5040, 1191 / 5040, 120 / 5040, 1 / 5040)
ANGLES = np.linspace(1e-3, np.pi, 20001)


def largest_step(degree: int, mass: str, transfer: str) -> float:
    """Largest stable ``c dt / h`` with B-splines of a degree and fully integrated matrices.

    With ``k`` and ``m`` the symbols of stiffness and consistent mass, leapfrog with the consistent
    mass allows ``2 / sqrt(k / m)``. With lumped mass the positions move with velocities that have
    been projected to the nodes and back, which multiplies them by m: FLIP keeps the velocities of
    the particles and allows ``2 / sqrt(k (2 - m))``; PIC and position differences replace them and
    allow ``sqrt(2 (1 + m) / k)``.

    Parameters
    ----------
    degree : int
        1, 2 or 3. Max-ent functions with the cubic spline and supports of 2 node spacings are those
        of degree 3.
    mass : {"lumped", "consistent"}
    transfer : {"flip", "position_difference"}
    """
    m = _symbol(2 * degree + 1)
    k = (2.0 - 2.0 * np.cos(ANGLES)) * _symbol(2 * degree - 1)
    if mass == "consistent":
        squares = 4.0 * m / k
    else:
        squares = 4.0 / (k * (2.0 - m)) if transfer == "flip" else 2.0 * (1.0 + m) / k
    return float(np.sqrt(squares.min()))


def _symbol(degree: int) -> np.ndarray:
    """``sum_j B(j) exp(i j angle)`` of a B-spline of odd degree."""
    first, *others = AT_INTEGERS[degree]
    total = np.full_like(ANGLES, first)
    for j, value in enumerate(others):
        total += 2.0 * value * np.cos((j + 1) * ANGLES)
    return total
