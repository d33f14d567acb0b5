"""Chapters beyond the paper on Iaconeta et al. 2017: what is computed for them, and what they say."""

import math

import numpy as np
import pytest

from mpmbench import case
from mpmbench.core.errors import NotApplicable
from mpmbench.papers import read_campaigns
from mpmbench.papers.iaconeta2017 import bounces, disk, soil, undisclosed
from mpmbench.papers.iaconeta2017.support import METHODS
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.tables import Cell
from mpmbench.runs.hydra import compose

SIN, COS = math.sin(bounces.SLOPE), math.cos(bounces.SLOPE)


def test_bounces_are_counted_from_each_landing():
    """A fall of 0.05 m, bounces of 0.02 and 0.03 m, and a ripple."""
    time = np.linspace(0.0, 1.0, 401)
    rise = np.interp(time, (0.0, 0.2, 0.4, 0.6, 0.8, 1.0), (0, -0.05, -0.03, -0.06, -0.03, -0.05))
    rise += 4e-4 * np.sin(1000.0 * time)
    assert bounces.bounces(rise) == pytest.approx([0.02, 0.03], abs=1e-3)
    assert bounces.bounces(-0.1 * time) == []


def falling_disk(spans, reach=0.05, height=0.55):
    """Histories of a disk that rolls at a height, and flies for the given numbers of steps of 1 ms."""
    time = np.linspace(0.0, 1.0, 1001)
    low = np.full(len(time), 0.9 * reach)
    for first, span in spans:
        low[first : first + span] = 1.1 * reach
    rise = np.full(len(time), height - bounces.RADIUS - reach)
    along = 0.4 * bounces.GRAVITY * SIN * time**2
    work = 100.0 * (SIN * along - COS * rise)
    return {
        "time": time,
        "lowest_particle": low,
        "centre_rise": rise,
        "centre_displacement": along,
        "centre_displacement_exact": along / 1.2,
        "external_work": work,
        "kinetic_energy": 0.97 * work,
        "strain_energy": 0.01 * work,
    }


def test_the_way_of_a_disk_is_taken_apart():
    one = bounces.motion(falling_disk([(0, 100), (500, 200)]), 0.05)
    assert one.aloft == pytest.approx(200 / 901)  # the fall through the gap is before the landing
    assert one.by_flights == pytest.approx(bounces.GRAVITY * SIN / 6.0 * (0.1**2 + 0.2**2))
    assert one.height == pytest.approx(0.55)
    exact = bounces.GRAVITY * SIN / 3.0
    assert one.ahead == pytest.approx(0.2 * exact)
    # a = g sin / (1 + I / (m d^2)) at the distance d, with I = m R^2 / 2
    at_height = 0.5 * bounces.GRAVITY * SIN / (1.0 + 0.5 * (0.5 / 0.55) ** 2)
    assert one.by_height == pytest.approx(at_height - exact)
    assert one.rest == pytest.approx(one.ahead - one.by_flights - one.by_height)
    assert one.balance[-1] == pytest.approx(-0.02)
    assert "loses 2 % of the work" in bounces.in_words("MPM", one)
    assert one.heights == [] and one.leap == 0.0


def test_the_highest_bounce_is_weighed_by_the_weight_across_the_plane():
    found = falling_disk([])
    found["centre_rise"] = np.interp(
        found["time"], (0.0, 0.2, 0.5, 0.8, 1.0), (0, -0.1, 0, -0.1, 0)
    )
    found["external_work"] = 100.0 * (
        SIN * found["centre_displacement"] - COS * found["centre_rise"]
    )
    one = bounces.motion(found, 0.05)
    assert one.heights == pytest.approx([0.1])
    assert one.leap == pytest.approx(100.0 * COS * 0.1 / found["external_work"][-1])


@pytest.mark.parametrize(
    ("ahead", "flights", "expected"),
    [(0.1, 0.4, True), (0.1, 0.1, False), (0.4, 0.6, False)],
)
def test_mpm_is_said_to_cancel_where_it_is_nearest_and_least_explained(ahead, flights, expected):
    def way(ahead, by_flights):
        return bounces.Motion([], 0.0, 0.5, ahead, by_flights, 0.0, np.zeros(1), 0.0)

    assert bounces.cancels(way(ahead, flights), [way(0.3, 0.2), way(0.3, 0.3)]) == expected


@pytest.mark.parametrize(
    ("run_outs", "expected"),
    [
        ((0.4, 1.2), "0.4 to 1.2 m over what the paper leaves open, a factor of 3"),
        ((0.4, 1.2), "weighs more"),
        ((0.5, 0.51), "weighs less"),
        ((0.4, "diverged", 1.2), "(Gaussian with degree 2 did not finish)"),
    ],
)
def test_the_undisclosed_choice_is_weighed_against_the_method(run_outs, expected):
    choices = (("cubic spline", "1, x, y"), ("Gaussian", "degree 2"), ("Gaussian", "1, x, y"))
    found = {choice: Cell(value) for choice, value in zip(choices, run_outs, strict=False)}
    others = {"MPM": Cell(0.48), "GMM-LME": Cell(0.52)}
    assert expected in undisclosed.weighed("The run-out", found, others)
    with pytest.raises(MissingRuns):
        undisclosed.weighed("The run-out", {choices[0]: Cell(0.4)}, others)


def test_a_particle_that_has_left_the_body_is_counted_beside_it():
    x = np.array([4.5, 4.4, 4.62, 667.0, 4.7, 4.85])
    assert undisclosed.front(x, 0.16) == pytest.approx((0.85, 1))
    assert undisclosed.front(x, 0.14) == pytest.approx((0.7, 2))
    assert undisclosed.front(x[x < 5.0], 0.16) == pytest.approx((0.85, 0))


def test_each_weight_and_polynomials_has_its_run_and_what_is_missing_has_no_row(
    tmp_path, write_run
):
    for name, run_out in (("MPM", 0.48), ("GMM-MLS", 0.43), ("GMM-LME", 0.52)):
        match, scalars = METHODS[name], {"final_run_out": run_out}
        write_run(
            tmp_path / "soil", match["method"], match["basis"], 40, scalars=scalars, snapshot=False
        )
    for mixed_terms, run_out in ((False, 0.6), (True, 0.9)):
        chosen = {"name": "mls", "weight": "gaussian", "degree": 1, "mixed_terms": mixed_terms}
        write_run(
            tmp_path / "mls_soil", "gmm", "mls", 40, scalars={"final_run_out": run_out},
            settings={"basis": chosen}, snapshot=False,
        )  # fmt: skip
    page = undisclosed.mls_soil_chapter(read_campaigns(tmp_path))
    assert {(row[0].text, row[1].text): row[2].text for row in page.tables[0].rows} == {
        ("cubic spline", "1, x, y"): "0.43",
        ("Gaussian", "1, x, y"): "0.6",
        ("Gaussian", "1, x, y, xy"): "0.9",
    }


def test_smoothed_particles_are_refused_for_the_reason_that_the_page_gives():
    ((config, reason),) = compose.compose_many([["method=sph", "problem=soil_column"]])
    assert reason == ""
    with pytest.raises(NotApplicable, match="has no nodes of its own"):
        case.read(config)


def test_times_of_the_disk_and_the_column_tell_of_load(tmp_path, write_run):
    """The same load in the table of the fine mesh and in those of the soil."""
    for experiment, names in (("rolling_fine", ("MPM", "GMM-LME")), ("soil", ("MPM", "GMM-LME"))):
        for name in names:
            match = METHODS[name]
            write_run(tmp_path / experiment, match["method"], match["basis"], 40, snapshot=False)
    campaigns = read_campaigns(tmp_path)
    busy = {name: one.only(one.runs.index == one.runs.index) for name, one in campaigns.items()}
    for one in busy.values():
        one.runs["load"] = 0.9
        one.runs["timing_context"] = "shared"
    page = disk.Chapter("table1", "")
    disk._fine(page, campaigns)
    assert "under load" not in page.tables[0].title and "unknown" in page.tables[0].note
    assert "timed alone" not in page.tables[0].note
    campaigns.update(busy)
    disk._fine(page, campaigns)
    soil._base(page, campaigns)
    assert all("made under load" in table.title for table in page.tables[1:])
    assert all("were not timed alone" in table.note for table in page.tables[1:])
