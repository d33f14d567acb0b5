"""What the page says was found: best at given cost, what failed and why, what coincides, what is asked for."""

import csv
import re

import numpy as np
import pytest

from mpmbench.report import build, curves, quantities
from mpmbench.report.figures import quantity_label
from mpmbench.report.findings import findings
from mpmbench.report.histories import Histories
from mpmbench.report.series import studies
from mpmbench.report.tables import all_runs
from mpmbench.results.records import read_campaign

BARE = {"snapshot": False}
# Of a problem without an exact solution.
NOTHING = dict.fromkeys(
    (
        *(f"error_{field}_rms" for field in ("displacement", "velocity", "stress")),
        "error_displacement_relative",
    ),
    np.nan,
)


def study_of(folder):
    (study,) = studies(read_campaign(folder))
    return study


def test_the_page_opens_with_sentences_computed_from_the_runs(tmp_path, write_run):
    for resolution in (8, 16):
        write_run(tmp_path, "mpm", resolution=resolution, constant=1e-3, **BARE)
        write_run(tmp_path, "otm", resolution=resolution, constant=1.005e-3, **BARE)
        write_run(tmp_path, "unified", resolution=resolution, constant=1e-2, **BARE)
    why = "particle 3 left the domain at step 7"
    write_run(tmp_path, "gmm", resolution=16, status="broke_down", reason=why)
    write_run(tmp_path, "fem", resolution=8, status="not_applicable", reason="no mesh")
    said = findings(study_of(tmp_path))
    # 1e-3 / 16**2 = 3.906e-6 m and the floor; mpm is the cheapest and the best at both sizes
    assert (
        said[0]
        == "MPM, linear is best at every cost. The smallest displacement error is 3.91e-06 m, in 0.0016 s."
    )
    assert "1 of 8 runs failed." in said
    assert f"GMM, linear at 16 cells broke down: {why}." in said
    assert "1 run does not apply to this problem." in said
    assert (
        "In their displacement error MPM, linear and OTM, linear coincide (within 1 % at all levels)."
        in said
    )
    assert not [sentence for sentence in said if "unified" in sentence and "coincide" in sentence]


def test_curves_with_the_same_value_are_counted_and_only_norms_are_said_to_be_some(
    tmp_path, write_run
):
    for number, method in enumerate(("mpm", "otm", "unified")):
        scalars = NOTHING | {"final_run_out": 0.5, "error_tip": 0.1 - 0.01 * number}
        write_run(tmp_path, method, scalars=scalars, **BARE)
        study = study_of(tmp_path)
        words = ("", " for both curves", " for all 3 curves")[number]
        assert f"Final run out: 0.5{words}." in findings(study)
    assert quantity_label(study, "error_tip") == "tip error"
    assert quantity_label(study, "error_displacement_rms") == "RMS displacement error [m]"


@pytest.mark.usefixtures("only_svg")
def test_quantities_of_interest_are_in_page_table_and_sentence(tmp_path, write_run):
    for method, far in (("mpm", 0.5), ("otm", 0.7)):
        for resolution in (8, 16):
            scalars = NOTHING | {"final_run_out": far + 1.0 / resolution, "newton_steps_mean": 1.0}
            write_run(tmp_path, method, resolution=resolution, scalars=scalars, **BARE)
    study = study_of(tmp_path)
    assert findings(study) == ["Final run out: from 0.562 (MPM, linear) to 0.762 (OTM, linear)."]
    assert quantities.names_of(study) == ["final_run_out"], "and not what the basis says"
    page = build(tmp_path).read_text("utf-8")
    assert "Final run out: from 0.562 (MPM, linear)" in page
    with open(tmp_path / "report/tables/bar_fixed_ends-quantities.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["final run out"]) for row in rows] == [0.625, 0.5625, 0.825, 0.7625]
    with open(tmp_path / "report/tables/bar_fixed_ends-histories.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 22 and float(rows[1]["time [s]"]) == pytest.approx(1e-4)
    assert float(rows[1]["kinetic energy [J]"]) == pytest.approx(np.cos(1e-4) ** 2)


def test_of_errors_with_a_sign_the_best_is_nearest_to_zero(tmp_path, write_run):
    for method, error in (("mpm", 1e-3), ("otm", -2e-3)):
        write_run(tmp_path, method, scalars=NOTHING | {"error_end": error}, **BARE)
    assert findings(study_of(tmp_path))[0].startswith(
        "MPM, linear is best at every cost. The smallest end error"
    )


def test_a_quantity_is_told_at_the_smallest_time_step(tmp_path, write_run):
    for step, run_out in ((1e-5, 0.5), (1e-6, 0.7)):
        write_run(tmp_path, time_step=step, scalars={"run_out": run_out}, **BARE)
    assert quantities.last_values(study_of(tmp_path), "run_out") == {"MPM, linear": 0.7}


def test_histories_that_are_zero_are_left_out(tmp_path, write_run):
    write_run(tmp_path, **BARE)
    assert Histories(study_of(tmp_path)).names == [
        "kinetic_energy",
        "strain_energy",
        "external_work",
    ]


def test_every_setting_that_varies_is_a_column(tmp_path, write_run):
    for degree, gravity in ((1, 9.81), (2, 9.81), (2, 1.62)):
        settings = {"basis": {"degree": degree}, "problem": {"gravity": gravity}}
        write_run(tmp_path, settings=settings, **BARE)
    table = all_runs(study_of(tmp_path))
    at = [table.columns.index(name) for name in ("degree", "gravity")]
    told = sorted(tuple(row[k].text for k in at) for row in table.rows)
    assert told == [("1", "9.81"), ("2", "1.62"), ("2", "9.81")]


def test_numbers_that_no_run_has_are_no_column(tmp_path, write_run):
    write_run(tmp_path, scalars={"energy_drift": np.nan}, **BARE)
    table = all_runs(study_of(tmp_path))
    assert "energy drift" not in table.columns and "Energy drift" not in table.note
    assert "Momentum drift:" in table.note


@pytest.mark.usefixtures("only_svg")
def test_a_curve_is_read_off_where_it_is_drawn(tmp_path, write_run):
    """The points of a curve in the drawing, by the limits of its axes, are the errors of its runs."""
    for resolution in (8, 16, 32):
        write_run(tmp_path, resolution=resolution, **BARE)
    study = study_of(tmp_path)
    text = build(tmp_path).read_text("utf-8")
    figure = re.search(
        r'<figure id="figure-bar_fixed_ends-convergence_displacement".*?</figure>', text, re.DOTALL
    ).group()
    assert 'aria-pressed="true" data-curve="0"' in figure
    import html
    import json

    (axes,) = json.loads(html.unescape(re.search(r'data-axes="([^"]*)"', figure).group(1)))
    _, _, bottom, top = axes["edges"]
    group = re.search(r'<g id="[^"]*curve-0-0">\s*<path d="([^"]*)"', figure).group(1)
    points = np.array(re.findall(r"-?\d+(?:\.\d+)?", group), float).reshape(-1, 2)
    share = (points[:, 1] - bottom) / (top - bottom)
    low, high = np.log10(axes["y"]["limits"])
    read = 10.0 ** (low + share * (high - low))
    assert np.allclose(read, study.series[0].runs.error_displacement_rms, rtol=1e-3)
    assert axes["y"]["words"] == "RMS displacement error [m]" and axes["y"]["log"]


def test_labels_are_plain_text():
    assert curves.plain("a\nb  costs \\$5") == "a b costs $5"
