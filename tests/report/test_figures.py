"""What the figures show: checked on the artists, not on pixels."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from mpmbench.report import coincide, figures, levels, profiles, style
from mpmbench.report.series import order_of, studies
from mpmbench.results.records import read_campaign

DISPLACEMENT = "error_displacement_rms"


def draw(folder):
    (study,) = studies(read_campaign(folder))
    orders = {
        one.label: order_of(study, one, DISPLACEMENT)
        for one in study.series
        if len(one.finite(DISPLACEMENT))
    }
    with style.applied():
        return study, figures.convergence(study, DISPLACEMENT, orders)


def lines(figure):
    return figure.axes[0].get_lines()


def entries(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_curves_carry_method_colour_basis_marker_and_data(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    _, figure = draw(tmp_path)
    curve = next(line for line in lines(figure) if line.get_marker() == "^")
    assert curve.get_color() == style.METHOD_COLOURS["otm"]
    assert curve.get_xdata().tolist() == [8, 16, 32, 64]
    assert curve.get_ydata() == pytest.approx(
        6e-5 * np.array([8.0, 16, 32, 64]) ** -3.5 + 2.764e-10
    )
    assert figure.axes[0].get_xscale() == figure.axes[0].get_yscale() == "log"
    assert figure.axes[0].get_ylabel() == "RMS displacement error [m]"


def test_an_axis_of_less_than_a_decade_has_a_few_numbers():
    for low, high in ((0.0054, 0.0089), (0.9, 2.5), (1.0, 15.0), (1e-4, 3e-1)):
        axes = Figure().subplots()
        axes.loglog([low, high], [low, high])
        figures.log_ticks(axes.xaxis, span=100.0)
        inside = [tick for tick in axes.get_xticks() if low <= tick <= high]
        assert 2 <= len(inside) <= 4, (low, high, inside)


def test_legend_states_fitted_orders(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    _, figure = draw(tmp_path)
    assert any(entry.startswith("MPM, linear (lumped mass): 2.00 (") for entry in entries(figure))


def test_predicted_floor_is_drawn_where_the_files_say(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    _, figure = draw(tmp_path)
    floor = [line for line in lines(figure) if "time integration alone" in line.get_label()]
    assert len(floor) == 1
    assert floor[0].get_ydata() == pytest.approx([2.764e-10] * 2)


def test_floor_follows_a_swept_time_step(tmp_path, write_run):
    for step in (4e-5, 2e-5, 1e-5):
        write_run(tmp_path, time_step=step, constant=0.0, floor=3.0 * step**2)
    _, figure = draw(tmp_path)
    (floor,) = [line for line in lines(figure) if "time integration alone" in line.get_label()]
    assert floor.get_ydata() == pytest.approx(3.0 * np.array([1e-5, 2e-5, 4e-5]) ** 2)


def test_failed_runs_are_crosses_and_inapplicable_ones_are_not(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    _, figure = draw(tmp_path)
    crosses = [line for line in lines(figure) if line.get_marker() == "x"]
    assert [(line.get_color(), list(line.get_xdata())) for line in crosses] == [
        (style.METHOD_COLOURS["unified"], [64])
    ]
    assert "failed (colour of the method)" in entries(figure)
    assert not any("GMM" in entry for entry in entries(figure))


def test_slope_triangles_have_their_slope(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    _, figure = draw(tmp_path)
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert labels[:2] == ["2", "3"]
    for triangle, order in zip(figure.axes[0].patches, map(float, labels), strict=True):
        (x0, y0), (x1, y1) = triangle.get_xy()[:2]
        assert np.log(y0 / y1) / np.log(x1 / x0) == pytest.approx(order)


def test_slope_triangles_stay_off_the_curves(tmp_path, write_run):
    """Curves of order 2 a factor 2.5 apart: beneath the lowest of them runs one of order 0.7."""
    for resolution in (8, 16, 32):
        write_run(tmp_path, "mpm", resolution=resolution, floor=0.0)
        write_run(tmp_path, "otm", resolution=resolution, constant=4e-5, order=1.2, floor=0.0)
    _, figure = draw(tmp_path)
    (axes,) = figure.axes
    assert len(axes.patches) >= 1
    for triangle in axes.patches:
        for line in axes.get_lines()[:2]:
            x = np.linspace(np.log(8.0), np.log(32.0), 200)
            y = np.interp(x, np.log(line.get_xdata()), np.log(line.get_ydata()))
            assert not triangle.get_path().contains_points(np.exp(np.column_stack([x, y]))).any()


def test_curves_that_coincide_are_said_to_and_both_are_seen(tmp_path, write_run):
    for resolution in (8, 16, 32):
        write_run(tmp_path, "mpm", resolution=resolution)
        write_run(tmp_path, "otm", resolution=resolution, constant=1.005e-3)
        write_run(tmp_path, "unified", resolution=resolution, constant=1.05e-3)
    study, figure = draw(tmp_path)
    said = coincide.caption(study, DISPLACEMENT, figure)
    assert said.endswith("MPM, linear and OTM, linear coincide (within 1 % at all levels).")
    beneath, above, apart = lines(figure)[:3]
    assert beneath.get_linewidth() > 2 * above.get_linewidth() == 2 * apart.get_linewidth()
    assert beneath.get_zorder() < above.get_zorder() and beneath.get_alpha() < 1.0


def test_a_caption_says_only_what_the_legend_has(tmp_path, write_run):
    for resolution in (8, 16, 32):
        write_run(tmp_path, "mpm", resolution=resolution)
    study, figure = draw(tmp_path)
    said = coincide.caption(study, DISPLACEMENT, figure)
    assert "Behind each curve" in said and "Triangles" in said
    assert "Crosses" not in said and "coincide" not in said
    for step in np.geomspace(1e-6, 9e-6, 12):
        write_run(tmp_path, "mpm", time_step=float(f"{step:.2g}"), order=0.2)
    write_run(tmp_path, "otm", status="diverged", reason="boom")
    study, figure = draw(tmp_path)
    said = coincide.caption(study, DISPLACEMENT, figure)
    assert "Behind" not in said and "in the table of orders" in said and "Crosses" in said


def test_many_curves_share_a_short_legend(tmp_path, write_run):
    for method in ("mpm", "otm"):
        for step in np.geomspace(1e-6, 1e-5, 8):
            for resolution in (8, 16):
                write_run(tmp_path, method, resolution=resolution, time_step=float(f"{step:.2g}"))
    _, figure = draw(tmp_path)
    assert len([line for line in lines(figure) if line.get_marker() == "o"]) == 16
    assert entries(figure)[:3] == ["MPM", "OTM", "linear"]
    assert sum("time step" in entry and "alone" not in entry for entry in entries(figure)) == 8


def test_nothing_is_drawn_without_a_finished_run(tmp_path, write_run):
    write_run(tmp_path, status="crashed", reason="boom")
    study, figure = draw(tmp_path)
    assert figure is None
    assert figures.work_precision(study, DISPLACEMENT) is None
    assert profiles.final_fields(study)[1] == []


def test_work_precision_prefers_exclusive_times(tmp_path, write_run):
    for resolution in (8, 16, 32):
        write_run(
            tmp_path,
            resolution=resolution,
            timing_context="shared" if resolution == 32 else "exclusive",
        )
    (study,) = studies(read_campaign(tmp_path))
    figure, exclusive = figures.work_precision(study, DISPLACEMENT)
    assert exclusive
    assert lines(figure)[0].get_xdata() == pytest.approx([8e-4, 1.6e-3])
    assert not figure.axes[0].texts


@pytest.mark.parametrize(
    "changed",
    (
        {"stress": None},
        {"position": None},
        {"stress": np.zeros((0, 3, 1))},
        {"stress": np.ones((2, 4, 1))},
    ),
)
def test_a_run_without_final_fields_has_no_panel(changed) -> None:
    """One of the two is not there, has no instant, or is that of other particles."""
    whole = {"position": np.zeros((2, 3, 1)), "stress": np.ones((2, 3, 1))}
    found = {key: part for key, part in (whole | changed).items() if part is not None}
    study = SimpleNamespace(campaign=SimpleNamespace(variables=lambda file, names: found))
    assert profiles._field(study, None, "") is None
    found |= whole
    assert profiles._field(study, None, "").stress.tolist() == [1.0, 1.0, 1.0]


def test_work_precision_marks_shared_times(tmp_path, write_quickstart):
    write_quickstart(tmp_path, timing_context="shared")
    (study,) = studies(read_campaign(tmp_path))
    figure, exclusive = figures.work_precision(study, DISPLACEMENT)
    assert not exclusive
    assert [text.get_text() for text in figure.axes[0].texts] == ["machine shared with other runs"]


def test_stress_profile_compares_particles_with_the_exact_solution_in_black(
    tmp_path, write_quickstart
):
    write_quickstart(tmp_path)
    (study,) = studies(read_campaign(tmp_path))
    value, fields = profiles.final_fields(study)
    assert value == 32, "the finest level that all curves finished"
    with style.applied():
        figure = profiles.stress_profile(fields)
    exact, particles = figure.axes[0].get_lines()
    assert exact.get_color() == "black"
    assert particles.get_color() == style.METHOD_COLOURS["mpm"]
    initial = fields[0].initial[:, 0]
    assert exact.get_ydata() == pytest.approx(100.0 * np.cos(np.pi * np.sort(initial)))
    assert exact.get_xdata() == pytest.approx(np.sort(initial + 1e-2 * np.sin(np.pi * initial)))


def test_profiles_of_many_variants_show_every_method(tmp_path, write_run):
    for step in np.geomspace(1e-6, 1e-5, 14):
        write_run(tmp_path, "mpm", time_step=float(step))
    write_run(tmp_path, "otm")
    for resolution in (8, 16):
        write_run(tmp_path, "otm", resolution=resolution, time_step=1e-6)
    (study,) = studies(read_campaign(tmp_path))
    _, fields = profiles.final_fields(study)
    assert {field.series.method for field in fields} == {"mpm", "otm"}
    assert len(fields) == levels.MOST_PANELS


def test_plane_problem_has_a_line_and_a_map(tmp_path, write_run):
    for resolution in (8, 16):
        write_run(
            tmp_path,
            resolution=resolution,
            dimension=2,
            particles_per_cell=16,
            problem="plate_axis_aligned",
        )
    (study,) = studies(read_campaign(tmp_path))
    _, fields = profiles.final_fields(study)
    with style.applied():
        profile, chart = profiles.stress_profile(fields), profiles.particle_map(fields)
    for figure in (profile, chart):
        titles = [axes.get_title().replace("\n", " ") for axes in figure.axes[: len(fields)]]
        assert titles == [field.series.name for field in fields]
    assert len(profile.axes[0].get_lines()[1].get_xdata()) == 64, "one row of particles"
    assert len(chart.axes[0].collections[0].get_offsets()) == 64**2
    assert "x_2" in chart.get_supylabel()


def test_maps_show_a_field_by_its_name() -> None:
    """Of the runs that have it; the scalars of a file count where they belong to its particles."""
    points = np.random.default_rng(0).random((2, 30, 2))
    found = {
        "position": points,
        "stress": np.ones((2, 30, 2, 2)),
        "temperature": 300.0 + points[..., 0],
    }
    found |= {"von_mises": np.ones((2, 29))}
    study = SimpleNamespace(campaign=SimpleNamespace(variables=lambda file, names: found))
    series = SimpleNamespace(name="a metal", method="mpm")
    metal = profiles._field(study, series, "")
    assert list(metal.scalars) == ["temperature"]
    plain = profiles.Field(series, points[-1], points[-1], np.zeros(30), np.zeros(30))
    with style.applied():
        chart = profiles.particle_map([plain, metal], "temperature")
        assert profiles.particle_map([plain, metal], "von_mises") is None
    cloud, *others = [axes.collections[0] for axes in chart.axes if axes.get_title()]
    assert not others and cloud.get_array().tolist() == (300.0 + points[-1, :, 0]).tolist()
    assert any("temperature [K]" in axes.get_xlabel() for axes in chart.axes)


@pytest.mark.parametrize("noise", [0.0, 1e-15])
def test_maps_of_a_constant_exact_stress_share_their_colours(tmp_path, write_run, noise):
    for resolution in (8, 16):
        write_run(tmp_path, resolution=resolution, dimension=2, problem="plate_axis_aligned")
    (study,) = studies(read_campaign(tmp_path))
    points = np.random.default_rng(0).random((30, 2))
    fields = [
        profiles.Field(study.series[0], points, points, scale * points[:, 0], np.zeros(30))
        for scale in (0.0, noise)
    ]
    with style.applied():
        chart = profiles.particle_map(fields)
    clouds = [axes.collections[0] for axes in chart.axes if "colorbar" not in axes.get_label()]
    assert len({cloud.get_clim() for cloud in clouds}) == 1
    for cloud in clouds:
        low, high = cloud.get_clim()
        assert low < high
        within = (cloud.get_array() >= low) & (cloud.get_array() <= high)
        assert np.mean(within) > 0.95  # all but the outermost hundredth at either end of all values


@pytest.mark.parametrize("layout", ["grid", "scattered"])
def test_line_of_particles_is_a_thin_sorted_row(layout):
    if layout == "grid":
        axis = (np.arange(20) + 0.5) / 20
        points = np.stack([part.ravel() for part in np.meshgrid(axis, axis, indexing="ij")], axis=1)
    else:
        points = np.random.default_rng(0).random((400, 2))
    row = profiles.line_of_particles(points)
    assert 10 <= len(row) <= 40
    assert np.all(np.diff(points[row, 0]) >= 0)
    assert np.all(np.abs(points[row, 1] - 0.5) <= 0.03)


def test_units_are_written_as_fractions():
    given = ("m s-1", "kg m-2", "kg m2 s-1", "m1.5 s-1", "m s-2", "J", "1")
    shown = ["m/s", "kg/m^2", "kg m^2/s", "m^1.5/s", "m/s^2", "J", ""]
    assert [figures.unit_text(unit) for unit in given] == shown
