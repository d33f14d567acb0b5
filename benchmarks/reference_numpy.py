"""The yardstick: one explicit MPM step in two dimensions, written with whole-array numpy and ``np.add.at``.

The same algorithm as the compiled loop (lumped mass, FLIP, update stress last, neo-Hookean), the
same open B-splines, the same particles; the benchmark checks that both give the same result.
"""

import numpy as np

from mpmbench.core.bases.grid.spline import TensorSpline
from mpmbench.core.state import State


def functions_along(
    spline: TensorSpline, axis: int, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Span, values (P, d + 1) and derivatives along one axis."""
    grid = spline.handle
    spans = spline.cells[axis]
    span = np.clip(((x - grid.breaks[axis, 0]) * grid.axes[axis]).astype(np.int64), 0, spans - 1)
    t = (x - grid.breaks[axis, span]) * grid.inverse_width[axis, span]
    coefficients = grid.coefficients[axis, span, :, : spline.degree + 1]
    powers = t[:, None] ** np.arange(spline.degree + 1)
    value = np.einsum("pka,pk->pa", coefficients, powers)
    slope = np.einsum(
        "pka,pk->pa", coefficients[:, 1:] * np.arange(1, spline.degree + 1)[:, None], powers[:, :-1]
    )
    return span, value, slope * grid.inverse_width[axis, span][:, None]


def numpy_step(s: State, spline: TensorSpline, dt: float) -> None:
    """Advance the particles of `s` by one step."""
    p, shape = s.particles, spline.handle.shape
    span_0, phi_0, slope_0 = functions_along(spline, 0, p.x[:, 0])
    span_1, phi_1, slope_1 = functions_along(spline, 1, p.x[:, 1])
    n = int(np.prod(shape))
    mass, momentum, force = np.zeros(n), np.zeros((n, 2)), np.zeros((n, 2))
    stencil = []
    for a in range(spline.degree + 1):
        for b in range(spline.degree + 1):
            node = (span_0 + a) * shape[1] + span_1 + b
            phi = phi_0[:, a] * phi_1[:, b]
            grad = np.stack([slope_0[:, a] * phi_1[:, b], phi_0[:, a] * slope_1[:, b]], axis=1)
            stencil.append((node, phi, grad))
            np.add.at(mass, node, p.m * phi)
            np.add.at(momentum, node, (p.m * phi)[:, None] * p.v)
            np.add.at(force, node, -p.V[:, None] * np.einsum("pde,pe->pd", p.sigma, grad))
    mass = np.where(mass > 0.0, mass, 1.0)[:, None]
    acceleration = np.where(s.fixed, 0.0, force / mass)
    velocity = np.where(s.fixed, 0.0, momentum / mass) + dt * acceleration
    gradient = np.zeros_like(p.F)
    for node, phi, grad in stencil:
        p.v += dt * phi[:, None] * acceleration[node]
        p.x += dt * phi[:, None] * velocity[node]
        gradient += velocity[node][:, :, None] * grad[:, None, :]
    p.F[:] = p.F + dt * gradient @ p.F
    J = np.linalg.det(p.F)
    p.V[:] = p.V0 * J
    identity = np.eye(2)
    b = p.F @ p.F.transpose(0, 2, 1)
    p.sigma[:] = (s.law.lame * np.log(J) / J)[:, None, None] * identity
    p.sigma += (s.law.shear / J)[:, None, None] * (b - identity)
