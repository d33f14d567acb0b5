"""Chapters on Taylor's rod, from files that are written here, and pictures of particles in space."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

from mpmbench.papers import read_campaigns
from mpmbench.papers.li2009 import taylor
from mpmbench.report import solids
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import single

SCALARS = {
    "length": 21.45e-3,
    "radius_nodes": 7.1e-3,
    "radius_points": 6.7e-3,
    "radius_fifth": 5.0e-3,
    "plastic_strain_max": 3.0,
    "von_mises_max": 450e6,
    "kinetic_share": 5e-4,
    "contact_share": 0.02,
    "transfer_share": 0.01,
    "energy_imbalance": 0.003,
    "solver_cpu_time": 2.0,
    "steps": 100.0,
}


def told(campaigns: Any, campaign: str, *wanted: str, **match: Any) -> tuple[str, dict[str, Any]]:
    """What a run of OTM would keep."""
    if campaign not in campaigns:
        raise MissingRuns(campaign)
    rng = np.random.default_rng(1)
    fields = {
        "snapshot_time": np.array([0.0, 2e-5, 4e-5, 8e-5]),
        "position": rng.uniform(0.0, 7e-3, (4, 50, 3)),
        "volume": np.tile(np.where(np.arange(50) < 46, 1e-11, 1e-16), (4, 1)),
        "plastic_strain": rng.uniform(0.0, 3.0, (4, 50)),
        "von_mises": np.linspace(1.0, 4.0, 4)[:, None] * np.arange(50) * 1e6,
        "time": np.linspace(0.0, 8e-5, 9),
        "length_history": np.linspace(32.4e-3, 21.45e-3, 9),
    }
    return "told", {name: fields[name] for name in wanted}


@pytest.fixture
def campaigns(tmp_path: Path, write_run: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """OTM with two levels, total-Lagrangian MPM that broke down, and the copper rod by OTM."""
    common = {"problem": "taylor_anvil", "dimension": 3, "particles_per_cell": 1}
    for folder in ("taylor", "johnson_cook"):
        (tmp_path / folder).mkdir()
        for cells in (2, 3):
            run = {"method": "otm", "basis": "lme", "resolution": cells, "scalars": SCALARS}
            write_run(tmp_path / folder, **run, **common)
    broken = {"method": "tlmpm", "basis": "bspline", "resolution": 2, "status": "broke_down"}
    write_run(tmp_path / "taylor", **broken, reason="particle 15 has a volume of 0", **common)
    monkeypatch.setattr(taylor, "variables", told)
    return read_campaigns(tmp_path)


def rows_of(chapter: Any, name: str) -> dict[tuple[Any, ...], list[Any]]:
    """Values of a table by its first two columns."""
    (table,) = [one for one in chapter.tables if one.name == f"{chapter.name}-{name}"]
    values = [[getattr(one, "value", one) for one in row] for row in table.rows]
    return {tuple(row[:2]): row[2:] for row in values}


@pytest.mark.slow  # its drawings take long; other tables of the chapter below
def test_table_5_1_stands_beside_ours(campaigns: Any) -> None:
    page = taylor.taylor_chapter(campaigns)
    (table,) = page.tables
    *_, thesis, _, ours, _ = ([one.value for one in row] for row in table.rows)
    assert thesis[1:5] == ["21.43", "6.8", "", "3.0"]
    assert ours[0].startswith("OTM here, 3 cells")
    assert ours[1:] == pytest.approx([21.45, 7.1, 6.7, 3.0, 450.0, 4.0 * 45])
    assert [one.name for one in page.drawings] == [
        f"taylor-{name}" for name in ("rod", "plastic_strain", "von_mises", "height")
    ]


def test_every_method_has_its_shape_and_its_cost(campaigns: Any) -> None:
    page = taylor.methods_chapter(campaigns)
    shape, cost = rows_of(page, "shape"), rows_of(page, "cost")
    assert set(shape) == {(name, cells) for name in taylor.RODS for cells in taylor.CELLS}
    assert shape["total-Lagrangian MPM, B-splines", 2][0] == "broke down"
    assert shape["linear FEM", 2][0] == ""
    found = cost["OTM", 3]
    assert found[:4] == [5e-4, 0.02, 0.01, 0.003]
    time = found[6]
    assert found[7] == pytest.approx(1e6 * time / (27 * 100))


def test_the_copper_rod_is_reported_beside_the_published_shape(campaigns: Any) -> None:
    page = taylor.copper_chapter(campaigns)
    rows = rows_of(page, "shape")
    assert rows["published, from memory", ""][:3] == [16.2, 13.5, 10.1]
    assert rows["OTM", 3][:3] == pytest.approx([21.45, 14.2, 10.0])


def test_near_particles_are_painted_last_and_bright() -> None:
    x = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [3.0, 0.0, 0.5]])
    place = solids.seen_from(x, up=0, azimuth=0.0, elevation=0.0)
    assert place[:, 2] == pytest.approx([1.0, -1.0, 0.0])  # the eye is far out on the second axis
    assert place[2, :2] == pytest.approx([0.5, 3.0])
    above = solids.seen_from(x, up=0, azimuth=0.0, elevation=90.0)
    assert above[2, 2] == pytest.approx(3.0)
    _, axes = single()
    dots = solids.draw(
        axes, x, np.array([1.0, 1.0, 0.0]), np.full(3, 0.1), matplotlib.colormaps["viridis"],
        (0.0, 1.0), azimuth=0.0, elevation=0.0,
    )  # fmt: skip
    assert np.asarray(dots.get_offsets())[:, 0] == pytest.approx([0.0, 0.5, 0.0])
    colours = np.asarray(dots.get_facecolor())
    assert np.allclose(colours[2, :3], matplotlib.colormaps["viridis"](1.0)[:3])
    assert colours[0, :3] == pytest.approx(solids.FARTHEST * colours[2, :3])


def test_a_quarter_is_mirrored_to_the_whole() -> None:
    x, values = solids.mirrored(np.array([[1.0, 2.0, 3.0]]), (1, 2), np.array([7.0]))
    assert sorted(map(tuple, x)) == [(1, -2, -3), (1, -2, 3), (1, 2, -3), (1, 2, 3)]
    assert values == pytest.approx([7.0] * 4)
