"""Von Neumann analysis: what a linear step on a row of equal cells makes of waves.

A wave ``u_n = u exp(i k n)``, with k in radians per cell, stays one: ``u <- sum_r A_r exp(-i k r) u``, where
A_r takes the unknowns of a cell to those of the r-th after it. The eigenvalues of this matrix are the
factors by which its parts grow in a step: ``exp(-i omega dt)``. A scheme is stable at k where none is
larger than one.
"""

import numpy as np

# Growth in a step that is rounding: a factor of one that three unknowns share is found to the third root of
# the error of the responses, some 1e-8. Slower growth is not seen.
ROUNDING = 1e-2


def factors(responses: np.ndarray, wave_numbers: np.ndarray) -> np.ndarray:
    """Eigenvalues at each wave number [rad], shape (K, d), from the responses A_r, shape (2 R + 1, d, d)."""
    reach = len(responses) // 2
    r = np.arange(-reach, reach + 1)
    waves = np.exp(-1j * np.outer(wave_numbers, r))
    return np.asarray(np.linalg.eigvals(np.einsum("kr,rij->kij", waves, responses)))


def growth_rates(found: np.ndarray, dt: float) -> np.ndarray:
    """Rate of the part that grows fastest [1/s], at each wave number, shape (K,); 0 where none does."""
    largest = np.abs(found).max(axis=1)
    return np.where(largest > 1.0 + ROUNDING, np.log(largest) / dt, 0.0)


def frequencies(found: np.ndarray, dt: float) -> np.ndarray:
    """Angular frequency of the fastest part [rad/s], at each wave number, shape (K,)."""
    return np.asarray(np.abs(np.angle(found)).max(axis=1) / dt)
