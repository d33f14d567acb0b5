"""The chapter on volumetric locking of the rod: two campaigns side by side, and what lies within the references."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mpmbench.papers import read_campaigns
from mpmbench.papers.li2009 import rod_locking, taylor
from mpmbench.report.evidence import MissingRuns

SHAPE = {
    "length": 21.4e-3,
    "radius_nodes": 7.0e-3,
    "radius_points": 6.7e-3,
    "plastic_strain_max": 3.0,
    "von_mises_max": 500e6,
    "energy_imbalance": 0.003,
    "steps": 100.0,
}


def told(*_: Any, **__: Any) -> tuple[str, dict[str, Any]]:
    n = 10
    fields = {"von_mises": np.full((1, n), 4e8), "volume": np.ones((1, n))}
    return "told", fields | {"pressure": np.append(np.linspace(-2e9, 1e9, n - 1), np.nan)[None]}


def test_runs_with_f_bar_stand_beside_those_without(
    tmp_path: Path, write_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    common = {"problem": "taylor_anvil", "dimension": 3, "particles_per_cell": 1, "resolution": 2}
    for folder, strain in (("taylor", 0.9), ("rod_locking", 3.0)):
        (tmp_path / folder).mkdir()
        run = {"method": "linear_fem", "basis": "linear"}
        scalars = SHAPE | {"plastic_strain_max": strain}
        write_run(tmp_path / folder, **run, **common, scalars=scalars)
    monkeypatch.setattr(taylor, "variables", told)
    monkeypatch.setattr(rod_locking, "variables", told)
    page = rod_locking.locking_chapter(read_campaigns(tmp_path))
    (table,) = page.tables
    rows = {
        tuple(one.value for one in row[:3]): [one.value for one in row[3:]] for row in table.rows
    }
    plain, shared = rod_locking.SHARED
    assert len(rows) == 3 * 2 * 3
    expected = [21.4, 7.0, 6.7, 3.0, 500.0, 400.0, -2000.0, 1000.0, 0.003]
    assert rows["linear FEM", shared, 2] == pytest.approx(expected)
    assert rows["linear FEM", plain, 2][3] == 0.9
    assert not any(rows["OTM", shared, 2])
    (drawing,) = page.drawings
    assert drawing.name == "rod_locking-levels"
    assert not page.notes  # they are of the finest runs


def test_what_lies_within_the_references_is_told() -> None:
    def cells(*values: float) -> list[Any]:
        return [type("Cell", (), {"value": value})() for value in values]

    (note,) = rod_locking.within("FEM", cells(21.4, 7.0, 6.7, 3.0, 500.0, 400.0))
    assert note.startswith("FEM: within") and "plastic strain 3;" in note
    assert note.endswith("outside are largest von Mises [MPa] 500.")
    (note,) = rod_locking.within("FEM", cells(20.0, 5.0, 4.0, 1.0, 500.0, 400.0))
    assert "Table 5.1 are none;" in note
    assert not [*rod_locking.within("FEM", cells("", "", "", "", ""))]  # type: ignore[arg-type]


def test_without_runs_there_is_no_chapter(tmp_path: Path) -> None:
    with pytest.raises((KeyError, MissingRuns)):
        rod_locking.locking_chapter(read_campaigns(tmp_path))
