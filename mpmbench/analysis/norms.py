"""Error norms over particles."""

import numpy as np


def root_mean_square(values: np.ndarray) -> float:
    """``sqrt(mean_p |e_p|^2)``, with the Frobenius norm for tensors (Wobbes 2020, Eq. 102 with the square restored).

    Parameters
    ----------
    values : ndarray
        Shape (P, ...); the first axis numbers the particles.
    """
    flat = np.asarray(values).reshape(len(values), -1)
    return float(np.sqrt(np.mean(np.sum(flat**2, axis=1))))


def error_norms(computed: np.ndarray, exact: np.ndarray) -> tuple[float, float]:
    """Root mean square of the error, and the same divided by that of the exact field (nan where this is zero)."""
    error, scale = root_mean_square(computed - exact), root_mean_square(exact)
    return error, error / scale if scale > 0.0 else float("nan")
