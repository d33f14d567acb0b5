"""What the roofline counts: bytes of the arrays that are touched, and operations of a plain loop."""

import numpy as np
import pytest

from benchmarks import roofline
from benchmarks.measure import plate


def test_bytes_are_those_of_the_arrays_that_each_kernel_touches() -> None:
    found = roofline.bytes_of(plate("linear", 4))
    assert found["p2g"] == 8 * (2 + 2 + 4 + 1 + 1)  # x, v, sigma, V, m
    assert found["g2p"] == 8 * (2 * (2 + 2 + 4) + 1 + 4 + 1)  # x, v, F twice, V0, sigma, V


def test_bytes_leave_out_no_array_that_a_kernel_changes() -> None:
    s = plate("linear", 4)
    roofline.step(s, 1e-5)
    p = s.particles
    before = {name: getattr(p, name).copy() for name in p.arrays._fields}
    tasks = roofline.kernels(s)
    tasks["p2g"]()
    assert all(np.array_equal(getattr(p, name), old) for name, old in before.items())
    s.nodes.v[:], s.nodes.a[:] = np.random.default_rng(0).uniform(1e9, 2e9, (2, *s.nodes.v.shape))
    tasks["g2p"]()
    changed = {name for name, old in before.items() if not np.array_equal(getattr(p, name), old)}
    assert changed == {"x", "v", "F", "sigma", "V"}


def test_operations_are_those_counted_by_hand() -> None:
    linear, quadratic = (roofline.operations(2, degree) for degree in (1, 2))
    # functions, 4 nodes, and V sigma and m v; in g2p instead F, its determinant, F F^T and the law
    assert linear["p2g"] == 14 + 4 * (3 + 14) + 6
    assert linear["g2p"] == 14 + 4 * (3 + 16) + 2 * 16 + 2 * 3 + 2 * 4 + 20 + 3 * 4 + 4 * 2
    # 9 nodes for 4, each: 3 products for value and gradient, 14 and 16 for the sums
    functions = 2 * (3 + 3 * 6) - 2 * (3 + 2 * 2)
    assert quadratic["p2g"] - linear["p2g"] == 5 * (3 + 14) + functions
    assert quadratic["g2p"] - linear["g2p"] == 5 * (3 + 16) + functions


@pytest.mark.parametrize("threads", [1, 2])
def test_every_part_of_the_arrays_is_moved(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(roofline, "ELEMENTS", 1001)
    seen = []
    original = roofline.triad

    def triad(a, b, c, start, stop):  # type: ignore[no-untyped-def]
        original(a, b, c, start, stop)
        seen.append((start, stop))

    monkeypatch.setattr(roofline, "triad", triad)
    assert roofline.bandwidth(threads) > 0.0
    parts = sorted(set(seen))
    assert len(parts) == threads
    assert sum(stop - start for start, stop in parts) == 1001 // threads * threads


def test_every_chain_does_all_its_multiply_adds() -> None:
    x = np.zeros((len(roofline.CHAINS), len(roofline.LANES)))
    roofline.multiply_add(x, 3)
    assert x == pytest.approx(1.0 - 0.999**3, rel=1e-12)  # 0.001 (1 + 0.999 + 0.999^2)
