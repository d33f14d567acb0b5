"""Explicit MPM in Taichi on one thread of the CPU: plain loops over particles and over one grid.

Sums on nodes are written as ``sum[i] = sum[i] + ...``: ``+=`` would be an atomic operation, which a
single thread needs not pay for.
"""

from typing import Any

import numpy as np
import taichi as ti

from .peers import Start


class Peer:
    """The state of one run; a step is three kernels.

    Parameters
    ----------
    start : Start
    """

    def __init__(self, start: Start) -> None:
        ti.init(
            arch=ti.cpu,
            default_fp=ti.f64,
            cpu_max_num_threads=1,
            offline_cache=False,
            log_level=ti.ERROR,
        )
        self.start = start
        count, dim = start.x.shape
        nodes = (start.cells + start.degree,) * dim
        self.x, self.v = (ti.Vector.field(dim, ti.f64, count) for _ in range(2))
        self.F = ti.Matrix.field(dim, dim, ti.f64, count)
        self.mass = ti.field(ti.f64, nodes)
        self.momentum, self.force = (ti.Vector.field(dim, ti.f64, nodes) for _ in range(2))
        self.p2g, self.on_nodes, self.g2p = kernels(start)

    def restart(self) -> None:
        """Put all particles back to where they started."""
        self.x.from_numpy(self.start.x)
        self.v.from_numpy(self.start.v)
        self.F.from_numpy(np.tile(np.eye(self.start.x.shape[1]), (len(self.start.x), 1, 1)))

    def run(self, steps: int, dt: float) -> None:
        """Do so many steps of `dt` [s]."""
        for _ in range(steps):
            self.mass.fill(0.0)
            self.momentum.fill(0.0)
            self.force.fill(0.0)
            self.p2g(self.x, self.v, self.F, self.mass, self.momentum, self.force)
            self.on_nodes(self.mass, self.momentum, self.force, dt)
            self.g2p(self.x, self.v, self.F, self.momentum, self.force, dt)
        ti.sync()

    def arrays(self) -> dict[str, np.ndarray]:
        """Places, velocities and deformation gradients now."""
        return {"x": self.x.to_numpy(), "v": self.v.to_numpy(), "F": self.F.to_numpy()}


def kernels(start: Start) -> tuple[Any, Any, Any]:
    """The kernels for a dimension and a degree."""
    dim, degree = start.x.shape[1], start.degree
    inverse, mass, volume = float(start.cells), start.mass, start.volume
    lame, shear = start.lame, start.shear
    window = tuple((degree + 1,) * dim)

    @ti.func
    def functions(x):  # type: ignore[no-untyped-def]
        """First node, and values and slopes along the axes, shape (degree + 1, dim)."""
        base = ti.cast(x * inverse, ti.i32)
        t = x * inverse - base
        value, slope = (
            ti.Matrix.zero(ti.f64, degree + 1, dim),
            ti.Matrix.zero(ti.f64, degree + 1, dim),
        )
        for d in ti.static(range(dim)):
            if ti.static(degree == 1):
                value[0, d], value[1, d] = 1.0 - t[d], t[d]
                slope[0, d], slope[1, d] = -inverse, inverse
            else:
                value[0, d] = 0.5 * (1.0 - t[d]) ** 2
                value[1, d] = 0.5 + t[d] - t[d] ** 2
                value[2, d] = 0.5 * t[d] ** 2
                slope[0, d] = (t[d] - 1.0) * inverse
                slope[1, d] = (1.0 - 2.0 * t[d]) * inverse
                slope[2, d] = t[d] * inverse
        return base, value, slope

    @ti.func
    def product(offset: ti.template(), value, slope):  # type: ignore[no-untyped-def, valid-type]
        """Value and gradient of one function."""
        weight, gradient = 1.0, ti.Vector.one(ti.f64, dim)
        for d in ti.static(range(dim)):
            weight *= value[offset[d], d]
            for e in ti.static(range(dim)):
                gradient[e] *= slope[offset[d], d] if ti.static(d == e) else value[offset[d], d]
        return weight, gradient

    @ti.kernel
    def p2g(
        x: ti.template(),  # type: ignore[valid-type]
        v: ti.template(),  # type: ignore[valid-type]
        F: ti.template(),  # type: ignore[valid-type]
        m_i: ti.template(),  # type: ignore[valid-type]
        q_i: ti.template(),  # type: ignore[valid-type]
        f_i: ti.template(),  # type: ignore[valid-type]
    ):
        ti.loop_config(serialize=True)
        for p in range(x.shape[0]):
            base, value, slope = functions(x[p])
            pressure = lame * ti.log(F[p].determinant()) - shear
            kirchhoff = shear * (F[p] @ F[p].transpose())
            for d in ti.static(range(dim)):
                kirchhoff[d, d] += pressure
            for offset in ti.static(ti.grouped(ti.ndrange(*window))):
                weight, gradient = product(offset, value, slope)
                i = base + offset
                m_i[i] = m_i[i] + weight * mass
                q_i[i] = q_i[i] + weight * mass * v[p]
                f_i[i] = f_i[i] - volume * (kirchhoff @ gradient)

    @ti.kernel
    def on_nodes(
        m_i: ti.template(),  # type: ignore[valid-type]
        v_i: ti.template(),  # type: ignore[valid-type]
        a_i: ti.template(),  # type: ignore[valid-type]
        dt: ti.f64,  # type: ignore[valid-type]
    ):
        """Accelerations in the place of forces, and velocities in that of momenta."""
        for i in ti.grouped(m_i):
            if m_i[i] > 0.0:
                a_i[i] /= m_i[i]
                v_i[i] = v_i[i] / m_i[i] + dt * a_i[i]

    @ti.kernel
    def g2p(
        x: ti.template(),  # type: ignore[valid-type]
        v: ti.template(),  # type: ignore[valid-type]
        F: ti.template(),  # type: ignore[valid-type]
        v_i: ti.template(),  # type: ignore[valid-type]
        a_i: ti.template(),  # type: ignore[valid-type]
        dt: ti.f64,  # type: ignore[valid-type]
    ):
        for p in range(x.shape[0]):
            base, value, slope = functions(x[p])
            velocity, change = ti.Vector.zero(ti.f64, dim), ti.Vector.zero(ti.f64, dim)
            L = ti.Matrix.zero(ti.f64, dim, dim)
            for offset in ti.static(ti.grouped(ti.ndrange(*window))):
                weight, gradient = product(offset, value, slope)
                i = base + offset
                velocity += weight * v_i[i]
                change += weight * a_i[i]
                L += v_i[i].outer_product(gradient)
            x[p] += dt * velocity
            v[p] += dt * change
            F[p] += dt * (L @ F[p])

    return p2g, on_nodes, g2p
