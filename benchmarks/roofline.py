"""What memory and vector arithmetic of this machine allow, and where the sums of explicit MPM stand.

Bandwidth is that of ``a = b + s c`` on arrays of `ELEMENTS` numbers, 24 bytes each: what a processor
reads before it overwrites is not counted. Arithmetic is `CHAINS` independent fused multiply-adds at
a time, 2 operations each, that stay in registers.

Bytes per particle are the arrays that a kernel must read and write, each once: p2g reads x, v,
sigma, V and m and g2p reads x, v, F and V0 and writes x, v, F, sigma and V; nodes are shared by so
many particles that they are left out. Operations per particle are counted as in a plain loop over the
nodes that a particle sees, where a product and a sum are 2, and those of the functions and of the
neo-Hookean law (a logarithm is 20) are added. A kernel that does the sums of a whole cell at once
needs fewer, so that its share of the arithmetic is what it achieves, not what it computes.
"""

from collections.abc import Callable
from statistics import median
from threading import Thread
from time import perf_counter
from typing import Any

import numpy as np
from numba import njit

from mpmbench.core.compiled import lean, matrix, threads
from mpmbench.core.compiled.rows import LANES, fill_row, multiply_and_add
from mpmbench.core.loops.explicit import carry, step
from mpmbench.core.state import State
from mpmbench.core.transfer.carry import Update
from mpmbench.results.provenance import processor

from .implicit import build
from .measure import REPEATS, plate
from .scaling import FINE

ELEMENTS = 40_000_000  # 320 MB each
CHAINS = (0.0,) * 12  # enough to hide how long one takes, and few enough for the registers
TERMS = 1_000_000
LOGARITHM = 20
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}


@njit(**OPTIONS)
def triad(a, b, c, start, stop):  # type: ignore[no-untyped-def]
    """``a = b + 3 c`` on a part of the arrays."""
    for i in range(start, stop):
        a[i] = b[i] + 3.0 * c[i]


@lean
def multiply_add(a, terms):  # type: ignore[no-untyped-def]
    """``x <- 0.999 x + 0.001`` so many times, for all chains at once; `a`, shape (chains, lanes), gets x."""
    x, one = matrix(CHAINS, LANES), matrix((0.0,), LANES)
    fill_row(LANES, one, 0, 0.001)
    for i in range(len(CHAINS)):
        fill_row(LANES, x, i, 0.0)
    for _ in range(terms):
        for i in range(len(CHAINS)):
            multiply_and_add(LANES, x, i, 0.999, one, 0)
    for i in range(len(CHAINS)):
        for k in range(len(LANES)):
            a[i, k] = x[i, k]


def together(task: Callable[[int], object], n: int) -> float:
    """Seconds until n threads have done ``task(0)`` to ``task(n - 1)``: the median of a few rounds."""
    found = []
    for _ in range(REPEATS + 1):
        others = [Thread(target=task, args=(k,)) for k in range(1, n)]
        begin = perf_counter()
        for one in others:
            one.start()
        task(0)
        for one in others:
            one.join()
        found.append(perf_counter() - begin)
    return median(found[1:])  # the first compiles


def bandwidth(n: int) -> float:
    """Bytes per second that n threads move."""
    a, b, c = np.zeros(ELEMENTS), np.ones(ELEMENTS), np.ones(ELEMENTS)
    part = ELEMENTS // n
    seconds = together(lambda k: triad(a, b, c, k * part, (k + 1) * part), n)
    assert a[part * n - 1] == 4.0
    return 3 * a.itemsize * part * n / seconds


def arithmetic(n: int) -> float:
    """Operations per second of n threads."""
    arrays = [np.zeros((len(CHAINS), len(LANES))) for _ in range(n)]
    seconds = together(lambda k: multiply_add(arrays[k], TERMS), n)
    assert abs(arrays[0].min() - 1.0) < 1e-9
    return 2.0 * arrays[0].size * TERMS * n / seconds


def bytes_of(s: State) -> dict[str, int]:
    """Bytes per particle that each kernel must read and write."""
    p = s.particles
    size = {name: getattr(p, name)[0].nbytes for name in ("x", "v", "F", "sigma", "V", "V0", "m")}
    read = sum(size[name] for name in ("x", "v", "sigma", "V", "m"))
    changed = sum(size[name] for name in ("x", "v", "F"))
    return {"p2g": read, "g2p": 2 * changed + size["V0"] + size["sigma"] + size["V"]}


def operations(dim: int, degree: int) -> dict[str, int]:
    """Operations per particle in a plain loop over the nodes that it sees.

    Functions along an axis: 3 for the local coordinate, and for each function a polynomial of the
    degree and its derivative. At each node: dim - 1 products for the value, as many for each entry
    of the gradient; p2g adds mass, momentum and ``sigma grad phi``; g2p adds velocity, acceleration
    and velocity gradient.
    """
    order = degree + 1
    functions = dim * (3 + order * (2 * degree + 2 * (degree - 1)))
    product = (dim - 1) * (1 + dim)
    to_nodes = 2 * (1 + dim) + 2 * dim * dim
    to_particles = 2 * dim + 2 * dim + 2 * dim * dim
    scaled = dim * dim + dim  # stress by the volume, velocity by the mass
    # (I + dt L) F, its determinant, F F^T, logarithm, stress and its division by J; x and v
    products = 2 * dim * dim * dim
    determinant = {1: 0, 2: 3, 3: 14}[dim]
    law = 2 * products + 2 * dim * dim + 2 * determinant + LOGARITHM + 3 * dim * dim + 4 * dim
    return {
        "p2g": functions + order**dim * (product + to_nodes) + scaled,
        "g2p": functions + order**dim * (product + to_particles) + law,
    }


def kernels(s: State) -> dict[str, Callable[[], object]]:
    """The sums on the nodes and the update of particles, as tasks that leave the particles in place."""
    update = Update(velocity=True, strain=True, position=True, acceleration=False, flip=1.0)

    def nothing(start: int, stop: int) -> None:
        pass

    return {
        "p2g": lambda: s.sums(s.basis.handle, s.particles.arrays, s.nodes, nothing),
        "g2p": lambda: carry(s, 1e-12, update),
    }


def roofline() -> None:
    """Memory, vector arithmetic, and the kernels between them."""
    print(f"\nRoofline of {processor()}")
    print(f"{'threads':>7} {'memory, GB/s':>13} {'arithmetic, GFlop/s':>20}")
    limits = {}
    for n in (1, 2):
        limits[n] = bandwidth(n), arithmetic(n)
        print(f"{n:7} {limits[n][0] / 1e9:13.1f} {limits[n][1] / 1e9:20.1f}")
    print(
        "\nKernels of explicit MPM: 513 x 513 nodes, 16 particles per cell, and 64^3 nodes, 8; by the clock"
    )
    print(
        f"{'kernel':16} {'threads':>7} {'bytes':>6} {'flop':>6} {'ns':>7} {'GB/s':>7} {'of limit':>8} "
        f"{'GFlop/s':>8} {'of limit':>8} {'bound, ns':>10}"
    )
    for dim, degree, basis in (
        (2, 1, "linear"),
        (2, 2, "bspline"),
        (3, 1, "linear"),
        (3, 2, "bspline"),
    ):
        s = plate(basis, 512) if dim == 2 else build(*FINE, "method=mpm", f"basis={basis}")
        step(s, 1e-9)
        traffic, flops, count = bytes_of(s), operations(dim, degree), len(s.particles.x)
        for name, task in kernels(s).items():
            for n in (1, 2):
                threads.use(n)
                seconds = together(lambda _, task=task: task(), 1) / count  # type: ignore[misc]
                moved, done = traffic[name] / seconds, flops[name] / seconds
                bound = max(traffic[name] / limits[n][0], flops[name] / limits[n][1])
                print(
                    f"{f'{basis} {name}, {dim}D':16} {n:7} {traffic[name]:6} {flops[name]:6} {seconds * 1e9:7.1f} "
                    f"{moved / 1e9:7.1f} {moved / limits[n][0]:8.0%} {done / 1e9:8.1f} "
                    f"{done / limits[n][1]:8.0%} {bound * 1e9:10.1f}"
                )
    threads.use(1)
