"""The comparison with peers refuses one that computes something else, and says what is not there."""

import importlib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import peers

SMALL = (2, 16, 4, 4)


class Plain:
    """A peer in numpy with linear functions, whose time step is off by a factor."""

    def __init__(self, start: peers.Start, factor: float = 1.0) -> None:
        self.start, self.factor = start, factor

    def restart(self) -> None:
        self.x, self.v = self.start.x.copy(), self.start.v.copy()
        self.F = np.tile(np.eye(2), (len(self.x), 1, 1))

    def run(self, steps: int, dt: float) -> None:
        for _ in range(steps):
            self.step(dt * self.factor)

    def step(self, dt: float) -> None:
        s, along = self.start, self.start.cells + 1
        base = (self.x * s.cells).astype(int)
        t = self.x * s.cells - base
        J = np.linalg.det(self.F)[:, None, None]
        b = self.F @ self.F.transpose(0, 2, 1)
        kirchhoff = s.shear * (b - np.eye(2)) + s.lame * np.log(J) * np.eye(2)
        m, q, f = np.zeros(along**2), np.zeros((along**2, 2)), np.zeros((along**2, 2))
        seen = []
        for i in (0, 1):
            for j in (0, 1):
                phi = np.stack([t[:, 0] if i else 1 - t[:, 0], t[:, 1] if j else 1 - t[:, 1]])
                slope = np.array([2 * i - 1, 2 * j - 1]) * s.cells
                w, g = phi[0] * phi[1], np.stack([slope[0] * phi[1], slope[1] * phi[0]], axis=1)
                k = (base[:, 0] + i) * along + base[:, 1] + j
                seen.append((k, w, g))
                np.add.at(m, k, s.mass * w)
                np.add.at(q, k, s.mass * w[:, None] * self.v)
                np.add.at(f, k, -s.volume * np.einsum("pij,pj->pi", kirchhoff, g))
        used = m > 0.0
        a, v = np.zeros_like(f), np.zeros_like(f)
        a[used] = f[used] / m[used, None]
        v[used] = q[used] / m[used, None] + dt * a[used]
        L = sum(v[k][:, :, None] * g[:, None, :] for k, _, g in seen)
        self.x += dt * sum(w[:, None] * v[k] for k, w, _ in seen)
        self.v += dt * sum(w[:, None] * a[k] for k, w, _ in seen)
        self.F += dt * (L @ self.F)

    def arrays(self) -> dict[str, np.ndarray]:
        return {"x": self.x, "v": self.v, "F": self.F}


def contenders(factor: float) -> dict[str, Any]:
    state = peers.block(*SMALL, degree=1)
    start = peers.start_of(state, SMALL[1], 1)
    return {"plain": Plain(start, factor), "mpmbench": peers.Ours(state)}


def test_a_peer_that_does_the_same_agrees_and_every_round_starts_anew() -> None:
    times, far = peers.rounds(contenders(1.0))
    assert far["plain"] < 1e-12
    assert far["mpmbench"] == 0.0
    assert [len(one) for one in times.values()] == [peers.ROUNDS] * 2


def test_a_peer_that_does_something_else_fails_the_section() -> None:
    with pytest.raises(SystemExit, match="plain differs by"):
        peers.rounds(contenders(1.0 + 1e-8))


def test_particles_are_sheared_and_stay_in_their_cells() -> None:
    ours = peers.Ours(peers.block(*SMALL, degree=2))
    ours.restart()
    before = {name: array.copy() for name, array in ours.arrays().items()}
    ours.run(peers.STEPS, peers.TIME_STEP)
    shear = ours.arrays()["F"][:, 0, 1]
    assert np.abs(shear).max() > 1e-4
    moved = np.abs(ours.arrays()["x"] - before["x"]).max()
    assert 1e-5 < moved < 0.5 / (2 * 128)  # not out of a cell of the finest grid


def test_what_is_not_a_number_differs() -> None:
    ours = {"x": np.ones(3)}
    assert peers.disagreement(ours, {"x": np.array([1.0, np.nan, 1.0])}) == np.inf


def test_peers_that_are_not_installed_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    lines: list[str] = []
    peers.table(lines.append, (SMALL,))
    rows = [line for line in lines if line.startswith("| 2D")]
    assert len(rows) == 2
    for row in rows:
        assert row.count("pip install 'mpmbench[peers]'") == 2
    assert lines[-1].strip() == "Kratos (implicit): not installed."


def test_the_table_is_written_only_when_asked_and_large_sizes_too(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    monkeypatch.setattr(peers, "SIZES", (SMALL,))
    monkeypatch.setattr(peers, "LARGE", ((2, 17, 4, 4),))
    monkeypatch.setattr(peers, "WRITTEN", tmp_path / "peers.md")
    assert peers.main(["--wirte"]) == 2
    assert peers.main([]) == 0
    assert not list(tmp_path.iterdir())
    assert "18^2" not in capsys.readouterr().out
    assert peers.main(["--large", "--write"]) == 0
    written = (tmp_path / "peers.md").read_text()
    assert "17^2 nodes, linear" in written
    assert "18^2 nodes, quadratic" in written


def test_a_table_takes_the_place_of_its_processors_own_and_leaves_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(peers, "WRITTEN", tmp_path / "peers.md")
    for name, text in (("old", "| 1 |"), ("new", "| 2 |\n\n| 3 |"), ("old", "| 4 |")):
        monkeypatch.setattr(peers, "processor", lambda name=name: name)
        peers.write(text)
    written = peers.WRITTEN.read_text()
    assert written == "# Beside its peers\n\n## new\n\n| 2 |\n\n| 3 |\n\n## old\n\n| 4 |\n"


def test_the_ratio_is_above_one_where_the_peer_is_slower() -> None:
    ratio = peers.ahead([1.0, 1.1, 0.9], [2.0, 2.2, 1.8])
    assert np.exp(ratio.shift) == pytest.approx(2.0)
    low, high = (np.exp(ratio.shift + sign * ratio.half_width) for sign in (-1.0, 1.0))
    assert 1.0 < low < 2.0 < high


@pytest.mark.parametrize("name", peers.PEERS)
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("degree", peers.BASES)
def test_peers_agree(name: str, dim: int, degree: int) -> None:
    if find_spec(name) is None:
        pytest.skip(f"{name} is not installed")
    size = SMALL if dim == 2 else (3, 10, 3, 8)
    state = peers.block(*size, degree)
    start = peers.start_of(state, size[1], degree)
    peer = importlib.import_module(f"benchmarks.peers_{name}").Peer(start)
    _, far = peers.rounds({name: peer, "mpmbench": peers.Ours(state)})
    assert far[name] < 10.0**-peers.DIGITS
