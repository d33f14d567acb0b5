"""A kernel that evaluates every function of a handle once, without storing anything."""

from mpmbench.core.bases.handle import count, locate, scratch, value
from mpmbench.core.compiled import compiled, vector


@compiled
def evaluate_all(phi, x):  # type: ignore[no-untyped-def]
    """Sum of all values and gradients at points x, shape (n, dim): keeps the compiler from leaving work out."""
    work, grad_phi = scratch(phi), vector(phi.axes)
    total = 0.0
    for p in range(x.shape[0]):
        at = locate(phi, x, p, work)
        for k in range(count(phi, at)):
            total += value(phi, at, k, work, grad_phi)
            for d in range(len(phi.axes)):
                total += grad_phi[d]
    return total
