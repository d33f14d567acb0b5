"""The failure atlas: checked on the artists."""

import pytest
from matplotlib.colors import to_hex

from mpmbench import report
from mpmbench.report import atlas, style
from mpmbench.report.series import studies
from mpmbench.results.records import read_campaign


def drawn(folder):
    (study,) = studies(read_campaign(folder))
    with style.applied():
        figure = atlas.atlas(study)
    figure.draw_without_rendering()
    needed = figure.get_tightbbox()
    assert needed.x0 >= 0.0 and needed.x1 <= figure.get_figwidth(), "something is cut off"
    axes = figure.axes[0]
    for patch in axes.patches:  # neither is a cell
        (left, below), (right, above) = axes.viewLim.min, axes.viewLim.max
        x, y = patch.get_xy()
        assert left < x and x + 0.9 < right and min(below, above) < y < max(below, above) - 0.9
    rows = [label.get_text() for label in axes.get_yticklabels()]
    columns = [label.get_text() for label in axes.get_xticklabels()]
    cells = {}
    for patch in axes.patches:
        column, row = (round(part + 0.45) for part in patch.get_xy())
        cells[rows[row], columns[column]] = to_hex(patch.get_facecolor())
    marks = {
        (rows[round(y)], columns[round(x)]): text.get_text()
        for text in axes.texts
        for x, y in [text.get_position()]
    }
    return study, cells, marks


def test_every_run_has_a_cell_of_the_colour_of_its_status(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    study, cells, marks = drawn(tmp_path)
    assert len(cells) == len(study.runs) == 21
    colours = {status: to_hex(colour) for status, colour in atlas.COLOURS.items()}
    assert cells["unified, B-spline (consistent mass)", "64"] == colours["broke_down"]
    assert cells["GMM, B-spline (lumped mass)", "8"] == colours["not_applicable"]
    assert ("GMM, B-spline", "16") not in cells
    assert set(marks) == {
        ("unified, B-spline (consistent mass)", "64"),
        ("GMM, B-spline (lumped mass)", "8"),
    }
    assert len(set(colours.values())) == len(colours)


def test_time_steps_are_columns_and_reasons_share_marks(tmp_path, write_run):
    for method in ("mpm", "otm"):
        for resolution in (8, 16):
            for step in (1e-5, 1e-6):
                bad = resolution == 16 and step == 1e-5
                reason = (
                    f"not finite in step {len(method) * 7} (t = {resolution * 1e-4:g} s)"
                    if bad
                    else ""
                )
                status = "diverged" if bad else "ok"
                write_run(
                    tmp_path,
                    method,
                    resolution=resolution,
                    time_step=step,
                    status=status,
                    reason=reason,
                )
    write_run(
        tmp_path,
        "mpm",
        resolution=32,
        status="diverged",
        reason="the iteration of max-ent ran away",
    )
    study, cells, marks = drawn(tmp_path)
    assert {column for _, column in cells} == {
        "8, 1e-05 s", "8, 1e-06 s", "16, 1e-05 s", "16, 1e-06 s", "32, 1e-05 s",
    }  # fmt: skip
    assert marks["MPM, linear", "16, 1e-05 s"] == marks["OTM, linear", "16, 1e-05 s"]
    assert marks["MPM, linear", "32, 1e-05 s"] != marks["MPM, linear", "16, 1e-05 s"]
    table = atlas.reasons(study)
    assert [row[2].value for row in table.rows] == [2, 1] or [
        row[2].value for row in table.rows
    ] == [1, 2]


@pytest.mark.usefixtures("only_svg")
def test_all_statuses_and_a_long_axis_label_fit(tmp_path, write_run):
    for k, status in enumerate(atlas.COLOURS):
        for step in (1e-5, 1e-6):
            write_run(
                tmp_path,
                resolution=4 + k,
                time_step=step,
                status=status,
                reason="" if status == "ok" else "why",
            )
    assert len(drawn(tmp_path)[1]) == 2 * len(atlas.COLOURS)


@pytest.mark.slow
def test_every_report_has_it(tmp_path, write_run):
    write_run(tmp_path, resolution=8)
    page = report.build(tmp_path).read_text()
    assert "Failure atlas" in page
    assert "Why runs have no result" not in page
    write_run(tmp_path, resolution=16, status="timeout", reason="stopped at limits.time = 5 s")
    page = report.build(tmp_path).read_text()
    assert "Why runs have no result" in page and "stopped at limits.time = 5 s" in page
