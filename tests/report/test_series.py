"""Reading a folder of results, and sorting runs into curves."""

import numpy as np
import pytest

from mpmbench.report import series
from mpmbench.report.coincide import differing
from mpmbench.report.series import further_studies, order_of, studies
from mpmbench.results.records import read_campaign


def one_study(folder):
    (study,) = studies(read_campaign(folder))
    return study


def test_settings_units_and_scalars_are_read(tmp_path, write_run):
    file = write_run(tmp_path, "otm", "maxent", 16, mass="consistent")
    campaign = read_campaign(tmp_path)
    assert campaign.runs.at[file.name, "error_displacement_rms"] == pytest.approx(
        1e-3 / 256 + 2.764e-10
    )
    assert campaign.runs.at[file.name, "resolution"] == 16
    assert campaign.settings.at[file.name, "method.mass"] == "consistent"
    assert campaign.units["error_stress_rms"] == "Pa"
    assert not {"campaign", "limits.time", "method.name", "seed"} & set(campaign.settings)


def test_unreadable_files_are_named_and_the_rest_is_read(tmp_path, write_run):
    write_run(tmp_path)
    (tmp_path / "broken.nc").write_bytes(b"CDF but not quite")
    (tmp_path / ".half-written.nc").write_bytes(b"")
    campaign = read_campaign(tmp_path)
    assert list(campaign.unreadable) == ["broken.nc"]
    assert len(campaign.runs) == 1


def test_folder_without_results_says_where_there_are_some(tmp_path, write_run):
    write_run(tmp_path / "quickstart")
    with pytest.raises(FileNotFoundError, match="there are some in quickstart"):
        read_campaign(tmp_path)
    with pytest.raises(FileNotFoundError, match="not a folder"):
        read_campaign(tmp_path / "nowhere")


def test_resolution_sweep_is_one_curve_per_method_and_basis(tmp_path, write_quickstart):
    write_quickstart(tmp_path)
    study = one_study(tmp_path)
    assert study.axis.key == "resolution"
    assert [one.label for one in study.series] == [
        *(
            "MPM, linear",
            "MPM, B-spline",
            "OTM, linear",
            "OTM, max-ent",
            "unified, B-spline",
            "GMM, B-spline",
        )
    ]
    assert study.values() == [8, 16, 32, 64]


def test_a_swept_choice_splits_curves_and_shares_its_line_style(tmp_path, write_run):
    for method in ("mpm", "otm"):
        for mass in ("lumped", "consistent"):
            for resolution in (8, 16):
                write_run(tmp_path, method, resolution=resolution, mass=mass)
    study = one_study(tmp_path)
    assert [(one.label, one.rank) for one in study.series] == [
        ("MPM, linear, mass consistent", 0),
        ("MPM, linear, mass lumped", 1),
        ("OTM, linear, mass consistent", 0),
        ("OTM, linear, mass lumped", 1),
    ]


def test_choices_that_differ_between_methods_only_do_not_enter_labels(tmp_path, write_run):
    for resolution in (8, 16):
        write_run(tmp_path, "mpm", resolution=resolution, mass="lumped")
        write_run(tmp_path, "otm", resolution=resolution, mass="consistent")
    assert [one.label for one in one_study(tmp_path).series] == ["MPM, linear", "OTM, linear"]


def test_time_step_that_goes_with_the_resolution_does_not_split(tmp_path, write_run):
    for resolution in (8, 16, 32):
        write_run(tmp_path, resolution=resolution, time_step=1e-4 / resolution)
    (curve,) = one_study(tmp_path).series
    assert list(curve.runs.axis_value) == [8, 16, 32]


def test_sweep_of_a_basis_key_labels_that_basis_only(tmp_path, write_run):
    for resolution in (8, 16):
        write_run(tmp_path, "mpm", "linear", resolution)
        for degree in (1, 2):
            write_run(
                tmp_path, "mpm", "bspline", resolution, settings={"basis": {"degree": degree}}
            )
    labels = [one.label for one in one_study(tmp_path).series]
    assert labels == ["MPM, linear", "MPM, B-spline, degree 1", "MPM, B-spline, degree 2"]


def test_time_step_sweep_has_its_order(tmp_path, write_run):
    for step in (4e-5, 2e-5, 1e-5, 5e-6, 2.5e-6):
        write_run(tmp_path, time_step=step, constant=0.0, floor=3.0 * step**2)
    study = one_study(tmp_path)
    assert study.axis.key == "time_step"
    assert study.values()[0] == 4e-5, "from coarse to fine"
    estimate = order_of(study, study.series[0], "error_displacement_rms")
    assert estimate.asymptotic == pytest.approx(2.0, abs=0.03)
    assert "over 4e-05..2.5e-06 s" in estimate.verdict


def test_a_second_axis_gets_its_own_study(tmp_path, write_run):
    for resolution in (8, 16):
        for per_cell in (2, 4, 8):
            write_run(tmp_path, resolution=resolution, particles_per_cell=per_cell)
    campaign = read_campaign(tmp_path)
    assert studies(campaign)[0].axis.key == "resolution"
    (second,) = further_studies(campaign)
    assert second.axis.key == "particles_per_cell"
    assert order_of(second, second.series[0], "error_displacement_rms") is None


def test_any_swept_number_can_be_the_axis(tmp_path, write_run):
    for amplitude in (0.005, 0.01, 0.02):
        write_run(
            tmp_path, settings={"problem": {"velocity_amplitude": amplitude}}, constant=amplitude
        )
    study = one_study(tmp_path)
    assert study.axis.key == "problem.velocity_amplitude"
    assert study.axis.label == "velocity amplitude [m/s]"


def test_each_problem_is_a_study(tmp_path, write_run):
    write_run(tmp_path, problem="bar_fixed_ends")
    write_run(tmp_path, problem="bar_dynamic_traction", time_step=1e-4)
    assert [study.problem for study in studies(read_campaign(tmp_path))] == [
        "bar_dynamic_traction",
        "bar_fixed_ends",
    ]


@pytest.mark.parametrize("status", ["diverged", "broke_down", "timeout", "not_applicable"])
def test_a_failed_run_never_enters_a_fit(tmp_path, write_run, status):
    for resolution in (8, 16, 32, 64):
        write_run(tmp_path, resolution=resolution, floor=0.0)
    plausible = {"error_displacement_rms": 1e-20, "solver_time": 1e-9}
    write_run(tmp_path, resolution=128, status=status, scalars=plausible)
    study = one_study(tmp_path)
    estimate = order_of(study, study.series[0], "error_displacement_rms")
    assert len(estimate.local) == 3
    assert estimate.slope == pytest.approx(2.0, abs=0.02)
    assert 128 not in study.series[0].finite("solver_time").axis_value.tolist()


def test_a_finished_run_without_its_error_is_left_out_of_the_fit(tmp_path, write_run):
    for resolution in (8, 16, 32):
        write_run(tmp_path, resolution=resolution)
    write_run(tmp_path, resolution=64, scalars={"error_displacement_rms": np.nan})
    study = one_study(tmp_path)
    assert len(order_of(study, study.series[0], "error_displacement_rms").local) == 2


def test_choices_that_differ_between_methods_are_named_with_what_makes_them_equal(
    tmp_path, write_run
):
    for resolution in (8, 16):
        write_run(tmp_path, "mpm", "maxent", resolution=resolution, mass="lumped")
        for method in ("otm", "unified"):
            extra = {"method": {"stress_update": "exact"}} if method == "otm" else None
            write_run(
                tmp_path,
                method,
                "maxent",
                resolution=resolution,
                mass="consistent",
                settings=extra,
            )
    (study,) = studies(read_campaign(tmp_path))
    assert [one.name for one in study.series] == [
        "MPM, max-ent (lumped mass)",
        "OTM, max-ent (consistent mass)",
        "unified, max-ent (consistent mass)",
    ]
    assert differing(study) == (
        "The curves differ in more than what is swept. mass: lumped for MPM, consistent for OTM "
        "and unified (method.mass=consistent makes them equal)."
    )


@pytest.mark.parametrize("most", (3, 2))
def test_choices_stay_out_of_names_where_many_differ(tmp_path, write_run, monkeypatch, most):
    """The sentence above the figures tells all of them in any case."""
    monkeypatch.setattr(series, "MOST_IN_NAMES", most)
    given = {"transfer": ("flip", "nodal"), "nodes": ("fixed", "moving")}
    for k, method in enumerate(("mpm", "otm")):
        own = {"method": {key: values[k] for key, values in given.items()}}
        write_run(tmp_path, method, mass=("lumped", "consistent")[k], settings=own)
    (study,) = studies(read_campaign(tmp_path))
    assert len(study.differences) == 3
    assert any(one.choices for one in study.series) == (most == 3)
    assert all(f"{key}: " in differing(study) for key in ("mass", "transfer", "nodes"))


def test_a_choice_that_some_method_sweeps_is_named_by_every_curve_and_is_no_hidden_one(
    tmp_path, write_run
):
    for resolution in (8, 16):
        for mass in ("lumped", "consistent"):
            write_run(tmp_path, "mpm", resolution=resolution, mass=mass)
        write_run(tmp_path, "otm", resolution=resolution, mass="consistent")
    (study,) = studies(read_campaign(tmp_path))
    assert [one.name for one in study.series] == [
        "MPM, linear, mass consistent",
        "MPM, linear, mass lumped",
        "OTM, linear (consistent mass)",
    ]
    assert differing(study) == ""


def test_errors_are_round_off_by_the_field_of_the_file_or_the_stiffness(tmp_path, write_run):
    for k, resolution in enumerate((8, 16, 32)):
        error, stress = 1e-15 * (1 + k % 2), 1e-10 * (1 + k % 2)  # of 0.1 m; E is 4000 Pa
        scalars = {"error_displacement_rms": error, "error_displacement_relative": 10.0 * error}
        scalars |= {"error_stress_rms": stress, "error_stress_relative": np.nan}
        write_run(tmp_path, resolution=resolution, scalars=scalars)
    study = one_study(tmp_path)
    for quantity in ("error_displacement_rms", "error_stress_rms"):
        assert order_of(study, study.series[0], quantity).course == "round-off"
    velocity = order_of(study, study.series[0], "error_velocity_rms")
    assert velocity.course != "round-off", "no field is known"
