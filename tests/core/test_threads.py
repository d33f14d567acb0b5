"""Work in chunks: the same bits for any number of threads, and no memory that two of them write to."""

from itertools import pairwise

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.compiled import threads
from tests.core.support import compose
from tests.support import slow_if

PLATE = {
    "problem": "plate_axis_aligned",
    "resolution": 6,
    "particles_per_cell": 9,
    "time_step": 1e-5,
}
BLOCK = {"problem": "isothermal_shock", "problem.dimension": 3, "resolution": 4}
RUNS = [
    PLATE | {"method": "mpm", "basis": "linear"},
    PLATE | {"method": "mpm", "basis": "linear", "method.stress_update": "usf"},
    PLATE | {"method": "mpm", "basis": "bspline", "method.stress_update": "musl"},
    PLATE | {"method": "mpm", "basis": "bspline", "method.mass": "consistent"},
    PLATE | {"resolution": 20, "method": "mpm", "basis": "bspline", "method.mass": "consistent"},
    PLATE | {"method": "mpm", "basis": "bspline", "method.transfer": "pic"},
    PLATE | {"method": "unified", "basis": "bspline"},
    PLATE | {"method": "otm", "basis": "maxent"},
    slow_if(True, PLATE | {"method": "otm", "basis": "lme"}),
    PLATE | {"method": "otm", "basis": "mls"},
    # in space all is compiled anew
    slow_if(True, BLOCK | {"method": "linear_fem", "basis": "linear"}),
    slow_if(True, BLOCK | {"method": "otm", "basis": "lme"}),
]


@pytest.fixture(autouse=True)
def one_thread_afterwards():
    yield
    threads.use(1)


def after_steps(settings: dict[str, object], count: int) -> dict[str, np.ndarray]:
    """Everything that five steps on so many threads write to the particles."""
    threads.use(count)
    state = case.build(case.read(compose(**settings)))
    for _ in range(5):
        state.choices.step(state, 1e-5)
    p = state.particles
    return {name: getattr(p, name) for name in ("x", "v", "F", "V", "sigma", "b")}


@pytest.mark.parametrize("settings", RUNS, ids=lambda one: " ".join(map(str, one.values())))
def test_threads_give_the_same_bits(monkeypatch, settings: dict[str, object]) -> None:
    monkeypatch.setattr(threads, "SMALLEST_CHUNK", 16)
    monkeypatch.setattr(threads, "FEW", 16)
    one = after_steps(settings, 1)
    assert len(threads.chunks(len(one["x"]))) > 4
    for count in (2, 4):
        other = after_steps(settings, count)
        for name, array in one.items():
            assert np.array_equal(array, other[name]), (count, name)
    assert np.abs(one["v"]).max() > 0.0
    if "plate" in str(settings["problem"]):
        assert np.abs(one["b"]).max() > 0.0


def test_chunks_have_no_page_in_common() -> None:
    rows = threads.apart(10 * threads.SMALLEST_CHUNK, 2, 3, dtype=np.int64)
    assert rows.shape == (8, 2, 3)
    for before, after in pairwise(rows):
        end, start = before.ctypes.data + before.nbytes - 1, after.ctypes.data
        assert end // threads.PAGE < start // threads.PAGE


@pytest.mark.parametrize("count", (1, 3))
def test_every_chunk_is_done_once_and_a_failure_is_raised(count: int) -> None:
    threads.use(count)
    particles, done = 10 * threads.SMALLEST_CHUNK, []
    threads.run(lambda c, start, stop: done.append((start, stop)), particles)
    assert sorted(done) == threads.chunks(particles)

    def fails(c: int, start: int, stop: int) -> None:
        if c == 5:
            raise ValueError("chunk 5")

    with pytest.raises(ValueError, match="chunk 5"):
        threads.run(fails, particles)
