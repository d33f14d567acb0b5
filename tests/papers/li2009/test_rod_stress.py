"""The chapter on the rod's largest stress: means over neighbours, and the sentence that is judged from the runs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mpmbench.papers import read_campaigns
from mpmbench.papers.li2009 import rod_stress


def test_means_take_out_what_alternates() -> None:
    """Stresses of one sign here and of the other there are nothing on the average; a shear is what it is."""
    x = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    sign = np.where(x.sum(axis=1) % 2.0 == 0.0, 1.0, -1.0)
    uniaxial = np.zeros((len(x), 3, 3))
    uniaxial[:, 0, 0] = 500.0 * sign
    assert rod_stress.von_mises(uniaxial) == pytest.approx(np.full(len(x), 500.0))
    assert rod_stress.von_mises(rod_stress.means_of(x, np.ones(len(x)), uniaxial)).max() < 300.0
    shear = np.zeros((len(x), 3, 3))
    shear[:, 0, 1] = shear[:, 1, 0] = 100.0
    means = rod_stress.means_of(x, 1.0 + x[:, 0], shear)
    assert rod_stress.von_mises(means) == pytest.approx(np.full(len(x), 100.0 * 3.0**0.5))


def test_changes_stand_side_by_side(
    tmp_path: Path, write_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "rod_stress").mkdir()
    scalars = dict.fromkeys(rod_stress.SHAPE, 0.02) | {"von_mises_max": 450e6}
    for gamma, largest in ((1.8, 450e6), (4.0, 600e6)):
        write_run(
            tmp_path / "rod_stress",
            problem="taylor_anvil",
            method="otm",
            basis="lme",
            dimension=3,
            scalars=scalars | {"von_mises_max": largest},
            settings={
                "basis": {"gamma": gamma, "gradient": "exact"},
                "method": {"transfer": "nodal", "drag": 0.0},
            },
        )
    monkeypatch.setitem(rod_stress.PLAIN, "end_time", 1e-3)  # of the files
    n = 20
    stress = np.zeros((1, n, 3, 3))
    stress[:, :, 0, 0] = 1e8
    fields = {
        "position": np.random.default_rng(0).random((1, n, 3)),
        "volume": np.ones((1, n)),
        "stress": stress,
        "von_mises": np.full((1, n), 1e8),
        "pressure": np.linspace(-2e9, 1e9, n)[None],
    }
    monkeypatch.setattr(rod_stress, "variables", lambda *_, **__: ("told", fields))
    page = rod_stress.stress_chapter(read_campaigns(tmp_path))
    rows = {row[0].value: [one.value for one in row[1:]] for row in page.tables[0].rows}
    shape = [20.0, 20.0, 0.02]
    assert rows["as in Table 5.1"] == [*shape, 450.0, 100.0, pytest.approx(100.0), -2e3, 1e3]
    assert rows["gamma = 4"][3] == 600.0 and not any(rows["masses kept"])
    (note,) = page.notes
    assert "in 1 of 2 runs, between 450 and 600 MPa" in note and "below the references in 2" in note
