"""Speed of functions on clouds of nodes, on one thread and on two, by the clock on the wall."""

from statistics import median
from time import perf_counter

import numpy as np

from mpmbench.core import registry
from mpmbench.core.compiled import threads
from mpmbench.core.geometry import Box, Cloud, tensor_points

from .goals import measured
from .measure import REPEATS

# Cells a side, and particles along each axis of a cell.
SIZES = {2: (128, 4), 3: (24, 2)}
CLOUDS = (("maxent", {"d_max": 3.0}), ("lme", {}), ("lme", {"gamma": 2.2}), ("mls", {}))


def jittered(dim: int, cells: int) -> Cloud:
    """Nodes of a box, those inside moved by up to a fifth of a cell."""
    points = Box((0.0,) * dim, (1.0,) * dim, (cells,) * dim).points.copy()
    inner = np.all((points > 0.5 / cells) & (points < 1.0 - 0.5 / cells), axis=1)
    points[inner] += np.random.default_rng(0).uniform(-0.2, 0.2, (int(inner.sum()), dim)) / cells
    return Cloud(points)


def functions() -> None:
    """Microseconds for all functions at one particle, as a step of OTM or GMM needs them."""
    print(
        "\nFunctions on jittered clouds, wall-clock us per particle (goal: LME in 3D 1.5; two threads 1.8)"
    )
    print(
        f"{'basis':22} {'dim':>3} {'particles':>9} {'nodes each':>10} {'1 thread':>9} {'2':>7} {'ratio':>6}"
    )
    for dim, (cells, along) in SIZES.items():
        cloud = jittered(dim, cells)
        x = tensor_points([(np.arange(cells * along) + 0.5) / (cells * along)] * dim)
        for name, settings in CLOUDS:
            basis = registry.get("basis", name)(**settings).build(cloud, len(x), True)
            basis.locate(x)
            times: dict[int, list[float]] = {1: [], 2: []}
            for _ in range(REPEATS):
                for n, found in times.items():
                    threads.use(n)
                    start = perf_counter()
                    basis.locate(x)
                    found.append((perf_counter() - start) / len(x) * 1e6)
            one, two = median(times[1]), median(times[2])
            what = " ".join([name, *(f"{key}={value:g}" for key, value in settings.items())])
            print(
                f"{what:22} {dim:3} {len(x):9} {basis.handle.size.mean():10.1f} {one:9.3f} {two:7.3f} {one / two:6.2f}"
            )
            if dim == 3 and what == "lme":
                measured("LME in 3D, a particle", one)
    threads.use(1)
