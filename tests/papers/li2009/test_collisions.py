"""Chapters on contact, from files that are written here."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mpmbench.papers import read_campaigns
from mpmbench.papers.li2009 import collisions, films, impact, round_bodies
from mpmbench.papers.li2009.collisions import CHECKS, RULES, SIX
from mpmbench.report.evidence import MissingRuns


@pytest.fixture
def campaigns(tmp_path: Path, write_run: Any) -> Any:
    """OTM with shared nodes on two squares in both orders, and on six cubes."""
    run = {"method": "otm", "basis": "lme", "resolution": 4, "dimension": 2}
    run["particles_per_cell"] = 1
    speeds = {False: (0.25, 1.75), True: (1.625, 0.125)}
    for folder in ("contact_checks", "six_cubes"):
        (tmp_path / folder).mkdir()
    for swapped, (one, other) in speeds.items():
        scalars = dict.fromkeys(CHECKS, 0.5) | {"velocity_1": one, "velocity_2": other}
        extra = {"problem": {"offset": 0.0, "swapped": swapped}}
        write_run(
            tmp_path / "contact_checks",
            problem="two_squares",
            scalars=scalars,
            settings=extra,
            **run,
        )
    scalars = dict.fromkeys(SIX, 0.25)
    write_run(tmp_path / "six_cubes", problem="six_cubes", scalars=scalars, **run)
    return read_campaigns(tmp_path)


def test_rules_stand_side_by_side(campaigns: Any) -> None:
    page = collisions.rules_chapter(campaigns)
    head_on, _ = page.tables
    assert [row[0].value for row in head_on.rows] == list(RULES)
    row = head_on.rows[list(RULES).index("shared, OTM")]
    assert [cell.value for cell in row[1:-1]] == [0.5] * len(CHECKS)
    assert row[-1].value == pytest.approx(0.125)  # velocity 1, and 2 in the other order
    assert not head_on.rows[0][1].value  # no such run


def test_six_cubes_are_drawn(campaigns: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def told(campaigns: Any, campaign: str, *wanted: str, **match: Any) -> tuple[str, Any]:
        if match != collisions.CUBES["shared, OTM"]:
            raise MissingRuns(campaign)
        time = np.linspace(0.0, 1.0, 5)
        fields = {"time": time, "body_momentum": np.ones((5, 6, 2))}
        fields |= dict.fromkeys(collisions.ENERGIES, time)
        fields |= {"snapshot_time": time[:3], "position": np.ones((3, 4, 2)), "body": np.ones(4)}
        return "told", {name: fields[name] for name in wanted}

    monkeypatch.setattr(collisions, "variables", told)
    page = collisions.cubes_chapter(campaigns)
    energy, momenta, motion = page.drawings
    assert len(motion.content.axes) == 2
    assert len(energy.content.axes[0].lines) == 4 and len(momenta.content.axes[1].lines) == 7
    total = energy.content.axes[0].lines[3].get_ydata()
    assert total[-1] == pytest.approx(3e-3)
    assert [cell.value for cell in page.tables[0].rows[0][1:]] == [0.25] * len(SIX)


def test_choices_about_six_cubes_stand_one_by_one(tmp_path: Path, write_run: Any) -> None:
    (tmp_path / "cubes_open").mkdir()
    for gamma, mass, value in ((1.8, "lumped", 0.5), (0.9, "lumped", 0.25), (1.8, "kept", 0.125)):
        write_run(
            tmp_path / "cubes_open",
            problem="six_cubes",
            method="otm",
            basis="lme",
            dimension=2,
            time_step=5e-5,
            mass=mass,
            scalars=dict.fromkeys(("energy_drift", *SIX), value),
            settings={"basis": {"gamma": gamma}, "method": {"transfer": "nodal"}},
        )
    (table,) = collisions.open_cubes_chapter(read_campaigns(tmp_path)).tables
    found = [[cell.value for cell in row[1:]] for row in table.rows]
    assert [row[0] for row in found[:2]] == [0.5, 0.25] and found[3] == [0.125] * 7
    assert not any(found[2]) and not any(found[4]) and not any(found[5])


def test_disks_and_rings_stand_beside_the_reference(tmp_path: Path, write_run: Any) -> None:
    (tmp_path / "round_bodies").mkdir()
    for problem, value in (("colliding_disks", 0.5), ("elastic_rings", 0.25)):
        write_run(
            tmp_path / "round_bodies",
            problem=problem,
            method="otm",
            basis="lme",
            dimension=2,
            scalars=dict.fromkeys(round_bodies.SHOWN, value),
            settings={"contact": {"name": "penalty"}},
        )
    disks, rings = round_bodies.round_chapter(read_campaigns(tmp_path)).tables
    names = list(round_bodies.METHODS)
    assert [row[0].value for row in disks.rows] == ["reference", *names]
    assert [row[0].value for row in rings.rows] == names
    for table, value in ((disks, 0.5), (rings, 0.25)):
        found = {row[0].value: [cell.value for cell in row[1:]] for row in table.rows}
        assert found["OTM, penalty"] == [value] * len(round_bodies.SHOWN)
        assert not any(found["OTM, shared"])


def test_each_impact_has_a_film(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the particles that start near the origin; what was not run is named."""
    times = np.linspace(0.0, 1e-3, 3)
    shown: list[Any] = []

    def told(campaigns: Any, campaign: str, *wanted: str, **match: Any) -> tuple[str, Any]:
        if match["problem"] == "six_cubes":
            raise MissingRuns(campaign)
        dim = 3 if match["problem"] in ("sphere_impact", "taylor_anvil") else 2
        x = np.zeros((3, 5, dim))
        x[:, :, 0] = np.arange(5) * 2e-3 + times[:, None]
        fields = {"snapshot_time": times, "position": x, "volume": np.full((3, 5), 1e-9)}
        fields |= {name: np.tile(np.arange(5.0), (3, 1)) for name in films.LABELS}
        return "told", {name: fields[name] for name in wanted}

    def noted(dataset: Any, name: str, view: Any) -> Any:
        shown.append(dataset)
        return film(dataset, name, view)

    film = films.film
    monkeypatch.setattr(films, "variables", told)
    monkeypatch.setattr(films, "film", noted)
    page = films.films_chapter({})  # type: ignore[arg-type]
    assert {one.name for one in page.animations} == {
        f"films-{name}" for name in films.FILMS if "cubes" not in name
    }
    for one in page.animations:
        picture = Image.open(io.BytesIO(one.content))
        assert (picture.format, picture.n_frames, picture.width) == ("GIF", 3, films.WIDTH)
    counts = {str(one.attrs["problem"]): one.sizes["particle"] for one in shown}
    assert counts == {"two_squares": 5, "sphere_impact": 3, "taylor_anvil": 5}
    assert page.notes == ["No run to show of: Six cubes, shared nodes, Six cubes, penalty."]


def test_depths_by_velocity_are_drawn_and_tabulated(
    tmp_path: Path, write_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("sphere_kept", "sphere_transfer", "sphere_open"):
        (tmp_path / folder).mkdir()
    run = {"method": "otm", "basis": "lme", "resolution": 2, "dimension": 3}
    for speed, folder, mass in (
        (500.0, "sphere_kept", "kept"),
        (1000.0, "sphere_kept", "kept"),
        (1500.0, "sphere_transfer", "lumped"),
    ):
        scalars = dict.fromkeys(impact.READ, 1e-3 * speed)
        settings = {"problem": {"speed": speed}}
        write_run(
            tmp_path / folder,
            problem="sphere_impact",
            mass=mass,
            scalars=scalars,
            settings=settings,
            **run,
        )

    def told(campaigns: Any, campaign: str, *wanted: str, **match: Any) -> tuple[str, Any]:
        if match["method"] != "otm":
            raise MissingRuns(campaign)
        fields = {"snapshot_time": np.arange(4.0), "position": np.zeros((4, 5, 3))}
        fields |= {"plastic_strain": np.ones((4, 5)), "body": np.ones(5), "volume": np.ones((4, 5))}
        return "told", {name: fields[name] for name in wanted}

    monkeypatch.setattr(impact, "variables", told)
    page = impact.impact_chapter(read_campaigns(tmp_path))
    assert len(page.drawings) == 4 and page.drawings[1].content.axes[0].lines
    rows = {(row[0].value, row[1].value): row[2].value for row in page.tables[0].rows}
    assert rows[impact.KEPT, 1000.0] == 1.0 and rows[impact.KEPT, 750.0] == "not run"
    assert rows[next(iter(impact.MAPPED)), 1500.0] == 1.5
    kept, made = page.drawings[1].content.axes[0].lines[:2]
    assert kept.get_xydata().tolist() == [[0.5, 0.5], [1.0, 1.0]]
    assert made.get_xydata().tolist() == [[1.5, 1.5]] and "by up to 150%" in made.get_label()
    with pytest.raises(MissingRuns):
        impact.impact_chapter(read_campaigns(tmp_path / "sphere_open"))


@pytest.mark.slow  # large files; chapters of other impacts above
def test_depths_stand_by_cells_and_rule(tmp_path: Path, write_run: Any) -> None:
    known = [name for name in impact.READ if name != "energy_imbalance"]
    cases: tuple[tuple[Any, ...], ...] = (
        ("sphere_rules", 1000.0, 2, "shared", "flip", 10.0),
        ("sphere_rules", 1000.0, 4, "shared", "nodal", 10.0),
        ("sphere_bands", 500.0, 3, "penalty", "flip", 10.0),
        ("sphere_bands", 500.0, 3, "shared", "flip", None),
    )
    for folder, speed, resolution, rule, transfer, exponent in cases:
        (tmp_path / folder).mkdir(exist_ok=True)
        settings = {"contact": {"name": rule}, "method": {"transfer": transfer}}
        settings |= {"problem": {"speed": speed}, "material": {"rate_exponent": exponent}}
        write_run(
            tmp_path / folder,
            problem="sphere_impact",
            method="mpm",
            basis="linear",
            resolution=resolution,
            dimension=3,
            scalars=dict.fromkeys(known, 0.25 * resolution),
            settings=settings,
        )
    (table,) = impact.cells_chapter(read_campaigns(tmp_path)).tables
    read = [tuple(cell.value for cell in (row[0], *row[2:7])) for row in table.rows]
    assert read == [
        (500.0, "shared", "particles", "no rate effect", 0.417, 0.75),
        (500.0, "penalty", "particles", "10", 0.417, 0.75),
        (1000.0, "shared", "particles", "10", 0.625, 0.5),
        (1000.0, "shared", "nodes", "10", 0.312, 1.0),
    ]
    assert {row[9].text for row in table.rows} == {""}  # these runs went well and do not have it


def test_a_setting_that_is_left_out_is_found(tmp_path: Path, write_run: Any) -> None:
    """No rate effect is no rate exponent, which a table of numbers holds as nan."""
    (tmp_path / "sphere_open").mkdir()
    for exponent in (10.0, None):
        changed = impact.BASE | {"material__rate_exponent": exponent, "problem__speed": 500.0}
        settings: dict[str, dict[str, Any]] = {}
        for key, value in changed.items():
            group, _, name = key.partition("__")
            settings.setdefault(group, {})[name] = value
        write_run(
            tmp_path / "sphere_open",
            problem="sphere_impact",
            scalars=dict.fromkeys(impact.READ, exponent or 0.7),
            settings=settings,
        )
    (table,) = impact.open_chapter(read_campaigns(tmp_path)).tables
    depths = {(row[0].value, row[1].value): row[2].value for row in table.rows}
    assert depths["no rate effect", 500.0] == 0.7
    assert depths[next(iter(impact.OPEN)), 500.0] == 10.0
