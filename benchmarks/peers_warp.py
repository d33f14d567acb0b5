"""Explicit MPM in NVIDIA's warp on the CPU, which it uses one thread of: plain loops over particles."""

from typing import Any

import numpy as np
import warp as wp

from .peers import Start

wp.config.quiet = True
wp.config.enable_backward = False
wp.config.max_unroll = 32  # all 27 nodes that a particle sees


class Peer:
    """The state of one run; a step is three kernels.

    Parameters
    ----------
    start : Start
    """

    def __init__(self, start: Start) -> None:
        wp.init()
        self.start = start
        self.count, dim = start.x.shape
        self.nodes = (start.cells + start.degree) ** dim
        vec = wp.types.vector(length=dim, dtype=wp.float64)
        mat = wp.types.matrix(shape=(dim, dim), dtype=wp.float64)
        self.x, self.v = (wp.zeros(self.count, dtype=vec, device="cpu") for _ in range(2))
        self.F = wp.zeros(self.count, dtype=mat, device="cpu")
        self.mass = wp.zeros(self.nodes, dtype=wp.float64, device="cpu")
        self.momentum, self.force = (
            wp.zeros(self.nodes, dtype=vec, device="cpu") for _ in range(2)
        )
        self.p2g, self.on_nodes, self.g2p = kernels(start, vec, mat)

    def restart(self) -> None:
        """Put all particles back to where they started."""
        self.x.assign(self.start.x)
        self.v.assign(self.start.v)
        self.F.assign(np.tile(np.eye(self.start.x.shape[1]), (self.count, 1, 1)))

    def run(self, steps: int, dt: float) -> None:
        """Do so many steps of `dt` [s]."""
        particles, sums = [self.x, self.v, self.F], [self.momentum, self.force]
        for _ in range(steps):
            for array in (self.mass, *sums):
                array.zero_()
            wp.launch(self.p2g, self.count, [*particles, self.mass, *sums], device="cpu")
            wp.launch(self.on_nodes, self.nodes, [self.mass, *sums, dt], device="cpu")
            wp.launch(self.g2p, self.count, [*particles, *sums, dt], device="cpu")

    def arrays(self) -> dict[str, np.ndarray]:
        """Places, velocities and deformation gradients now."""
        return {"x": self.x.numpy(), "v": self.v.numpy(), "F": self.F.numpy()}


def kernels(start: Start, vec: Any, mat: Any) -> tuple[Any, Any, Any]:
    """The kernels for a dimension and a degree."""
    dim, degree = start.x.shape[1], start.degree
    order, along = degree + 1, start.cells + degree
    window = order**dim
    inverse, mass, volume = (
        wp.constant(wp.float64(number)) for number in (start.cells, start.mass, start.volume)
    )
    lame, shear = wp.constant(wp.float64(start.lame)), wp.constant(wp.float64(start.shear))
    one, half, two = (wp.constant(wp.float64(number)) for number in (1.0, 0.5, 2.0))
    table = wp.types.matrix(shape=(dim, order), dtype=wp.float64)
    corner = wp.types.vector(length=dim, dtype=wp.int32)

    @wp.func
    def first_node(x: vec):  # type: ignore[no-untyped-def, valid-type]
        at = corner()
        for d in range(dim):
            at[d] = wp.int32(x[d] * inverse)
        return at

    @wp.func
    def values(x: vec, at: corner):  # type: ignore[no-untyped-def, valid-type]
        """Along the axes, shape (dim, degree + 1)."""
        phi = table()
        for d in range(dim):
            t = x[d] * inverse - wp.float64(at[d])
            if wp.static(degree == 1):
                phi[d, 0] = one - t
                phi[d, 1] = t
            else:
                phi[d, 0] = half * (one - t) * (one - t)
                phi[d, 1] = half + t - t * t
                phi[d, order - 1] = half * t * t
        return phi

    @wp.func
    def slopes(x: vec, at: corner):  # type: ignore[no-untyped-def, valid-type]
        phi = table()
        for d in range(dim):
            t = x[d] * inverse - wp.float64(at[d])
            if wp.static(degree == 1):
                phi[d, 0] = -inverse
                phi[d, 1] = inverse
            else:
                phi[d, 0] = (t - one) * inverse
                phi[d, 1] = (one - two * t) * inverse
                phi[d, order - 1] = t * inverse
        return phi

    @wp.func
    def place(at: corner, k: int):  # type: ignore[no-untyped-def, valid-type]
        """Number of the k-th node that a particle sees."""
        i = at[0] + k % order
        rest = k // order
        for d in range(1, dim):
            i = i * along + at[d] + rest % order
            rest = rest // order
        return i

    @wp.func
    def weight(k: int, phi: table):  # type: ignore[no-untyped-def, valid-type]
        w = one
        rest = k
        for d in range(dim):
            w *= phi[d, rest % order]
            rest = rest // order
        return w

    @wp.func
    def gradient(k: int, phi: table, slope: table):  # type: ignore[no-untyped-def, valid-type]
        g = vec()
        for e in range(dim):
            w = one
            rest = k
            for d in range(dim):
                if d == e:
                    w *= slope[d, rest % order]
                else:
                    w *= phi[d, rest % order]
                rest = rest // order
            g[e] = w
        return g

    @wp.kernel(module="unique")
    def p2g(
        x: wp.array(dtype=vec),  # type: ignore[valid-type]
        v: wp.array(dtype=vec),  # type: ignore[valid-type]
        F: wp.array(dtype=mat),  # type: ignore[valid-type]
        m_i: wp.array(dtype=wp.float64),  # type: ignore[valid-type]
        q_i: wp.array(dtype=vec),  # type: ignore[valid-type]
        f_i: wp.array(dtype=vec),  # type: ignore[valid-type]
    ):
        p = wp.tid()
        at = first_node(x[p])
        phi = values(x[p], at)
        slope = slopes(x[p], at)
        F_p = F[p]
        kirchhoff = shear * (F_p * wp.transpose(F_p))
        pressure = lame * wp.log(wp.determinant(F_p)) - shear
        for d in range(dim):
            kirchhoff[d, d] = kirchhoff[d, d] + pressure
        momentum = mass * v[p]
        for k in range(window):
            i = place(at, k)
            w = weight(k, phi)
            m_i[i] = m_i[i] + w * mass
            q_i[i] = q_i[i] + w * momentum
            f_i[i] = f_i[i] - volume * (kirchhoff * gradient(k, phi, slope))

    @wp.kernel(module="unique")
    def on_nodes(
        m_i: wp.array(dtype=wp.float64),  # type: ignore[valid-type]
        v_i: wp.array(dtype=vec),  # type: ignore[valid-type]
        a_i: wp.array(dtype=vec),  # type: ignore[valid-type]
        dt: wp.float64,
    ):
        """Accelerations in the place of forces, and velocities in that of momenta."""
        i = wp.tid()
        if m_i[i] > wp.float64(0.0):
            a_i[i] = a_i[i] / m_i[i]
            v_i[i] = v_i[i] / m_i[i] + dt * a_i[i]

    @wp.kernel(module="unique")
    def g2p(
        x: wp.array(dtype=vec),  # type: ignore[valid-type]
        v: wp.array(dtype=vec),  # type: ignore[valid-type]
        F: wp.array(dtype=mat),  # type: ignore[valid-type]
        v_i: wp.array(dtype=vec),  # type: ignore[valid-type]
        a_i: wp.array(dtype=vec),  # type: ignore[valid-type]
        dt: wp.float64,
    ):
        p = wp.tid()
        at = first_node(x[p])
        phi = values(x[p], at)
        slope = slopes(x[p], at)
        velocity = vec()
        change = vec()
        L = mat()
        for k in range(window):
            i = place(at, k)
            w = weight(k, phi)
            velocity += w * v_i[i]
            change += w * a_i[i]
            L += wp.outer(v_i[i], gradient(k, phi, slope))
        x[p] = x[p] + dt * velocity
        v[p] = v[p] + dt * change
        F[p] = F[p] + dt * (L * F[p])

    return p2g, on_nodes, g2p
