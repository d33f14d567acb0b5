"""The report on Iaconeta et al. 2017: verdicts follow from runs, experiments compose, pictures move."""

import itertools

import numpy as np
import pytest
import yaml

from mpmbench import case
from mpmbench.papers import Campaigns, find, read_campaigns
from mpmbench.papers.iaconeta2017 import disk, soil, support
from mpmbench.papers.iaconeta2017.support import METHODS
from mpmbench.report.claims import FAILS, HOLDS, UNDECIDED, SetUp, judge, judge_in
from mpmbench.report.evidence import MissingRuns
from mpmbench.runs.hydra import compose
from mpmbench.settings import schema
from tests.support import slow_if

PAPER = "iaconeta2017"


def verdict(name, folder):
    claim = next(claim for claim in find(PAPER).claims if claim.name == name)
    return judge(claim, read_campaigns(folder))


def write_fig7(write_run, folder, order=2.0, mls=0.9):
    """Errors that fall with an order, those of GMM-MLS a given part of the others."""
    for name, match in METHODS.items():
        for n in (16, 32, 64, 128):
            error = (mls if name == "GMM-MLS" else 1.0) * 0.1 * (16 / n) ** order
            write_run(
                folder, match["method"], match["basis"], n, scalars={"error_tip": error},
                settings={"problem": {"load_steps": 1}}, snapshot=False,
            )  # fmt: skip


def write_load_steps(write_run, folder, change):
    for steps, deflection in ((1, -0.65), (50, -0.65 * (1.0 + change))):
        settings = {"problem": {"load_steps": steps}, "method": {"ghost_stiffness": 0.0}}
        scalars = {"tip_deflection": deflection}
        write_run(
            folder, "implicit_mpm", "linear", 32, scalars=scalars, settings=settings, snapshot=False
        )


def test_orders_decide(tmp_path, write_run):
    write_fig7(write_run, tmp_path / "fig7")
    assert verdict("quadratic", tmp_path).answer == HOLDS
    write_fig7(write_run, tmp_path / "fig7", order=1.0)
    found = verdict("quadratic", tmp_path)
    assert found.answer == FAILS
    assert "p = 1.00" in found.because


def test_load_steps_make_the_coincidence_conditional(tmp_path, write_run):
    write_fig7(write_run, tmp_path / "fig7")
    write_load_steps(write_run, tmp_path / "load_steps", 0.012)
    assert (
        verdict("curves", tmp_path).answer == "holds in part: when the load is applied in one step"
    )
    write_load_steps(write_run, tmp_path / "load_steps", 0.0)
    assert verdict("curves", tmp_path).answer == HOLDS
    write_fig7(write_run, tmp_path / "fig7", mls=0.3)
    assert verdict("curves", tmp_path).answer == FAILS


@pytest.mark.parametrize(
    ("ended", "helped", "answer"),
    [
        ({}, {"MPM": 0, "GMM-MLS": 3, "GMM-LME": 1}, HOLDS),
        ({}, {"MPM": 2, "GMM-MLS": 3, "GMM-LME": 1}, FAILS),
        ({"GMM-LME": "diverged"}, {"MPM": 2, "GMM-MLS": 0, "GMM-LME": 0}, HOLDS),
        (
            {"GMM-LME": "diverged", "MPM": "not_converged"},
            {"MPM": 0, "GMM-MLS": 0, "GMM-LME": 0},
            FAILS,
        ),
    ],
)
def test_robust_is_what_ends_with_the_fewest_steps_that_need_help(
    tmp_path, write_run, ended, helped, answer
):
    for name, steps in helped.items():
        for n in (40, 80):
            match, status = METHODS[name], ended.get(name, "ok")
            write_run(
                tmp_path / "soil", match["method"], match["basis"], n, status=status, snapshot=False,
                scalars={"stiffened_steps": steps - steps // 2, "halved_steps": steps // 2},
            )  # fmt: skip
    settings = {"method": {"ghost_stiffness": 0.0}}
    write_run(
        tmp_path / "soil_check", "implicit_mpm", "linear", 40, settings=settings, snapshot=False
    )
    assert verdict("robust", tmp_path).answer == answer


@pytest.mark.parametrize(
    ("advance", "failed", "answer", "because"),
    [
        ({}, (), HOLDS, "differ by 4 %"),
        ({("GMM-LME", 80): 0.6}, (), FAILS, "differ by 20 %"),
        ({}, (("GMM-MLS", 80),), FAILS, "GMM-MLS not converged"),
        ({("GMM-LME", 160): 0.6}, (), FAILS, "h = 0.025 m: MPM 0.500 m"),
    ],
)
def test_columns_coincide_on_every_mesh_or_not_at_all(
    tmp_path, write_run, advance, failed, answer, because
):
    fine = any(n == 160 for _, n in advance)
    for n, experiment in ((40, "soil"), (80, "soil"), *([(160, "soil_fine")] if fine else [])):
        for name in ("MPM", "GMM-MLS", "GMM-LME"):
            match = METHODS[name]
            scalars = {"final_run_out": advance.get((name, n), 0.52 if name == "GMM-MLS" else 0.5)}
            status = "not_converged" if (name, n) in failed else "ok"
            folder = tmp_path / experiment
            write_run(
                folder,
                match["method"],
                match["basis"],
                n,
                scalars=scalars,
                status=status,
                snapshot=False,
            )
    found = verdict("columns", tmp_path)
    assert found.answer == answer
    assert because in found.because
    assert ("0.025" in found.because) == fine


def test_a_run_that_was_stopped_is_a_row_and_not_an_accident(tmp_path, write_run):
    """It holds no histories: nothing is drawn of it, and its row says how it ended."""
    match = {**METHODS["GMM-MLS"], "resolution": 160}
    write_run(tmp_path / "soil_fine", "gmm", "mls", 160, status="timeout", snapshot=False)
    campaigns = read_campaigns(tmp_path)
    with pytest.raises(MissingRuns, match="timeout"):
        support.history(campaigns, "soil_fine", "run_out", **match)
    assert [cell.value for cell in soil._end(campaigns, "soil_fine", "solver_time", match)] == [
        "timeout"
    ] * 5
    assert not any(
        cell.value
        for cell in soil._end(campaigns, "soil_fine", "solver_time", {**match, "resolution": 80})
    )


def test_overheads_are_those_of_the_printed_table():
    """Least: GMM-LME, gamma = 1.8, second time step; largest: gamma = 2.8, third one."""
    assert disk.printed_overheads() == pytest.approx(
        (460.50 / 472.92 - 1.0, 1038.70 / 894.91 - 1.0)
    )


def test_without_runs_everything_waits(tmp_path):
    for claim in find(PAPER).claims:
        assert judge(claim, Campaigns()).answer == UNDECIDED


def test_surface_and_moving_picture():
    position = np.array([[0.05, 0.1], [0.07, 0.4], [0.15, 0.2], [0.45, 0.3]])
    x, y = soil.surface(position, 0.1)
    assert np.allclose(x, [0.05, 0.15, 0.45])
    assert np.allclose(y, [0.4, 0.2, 0.3])
    moving = np.stack([position, position + 0.5, position + 1.0])
    gif = soil.moving_picture(np.array([0.0, 1.0, 2.0]), moving, np.zeros((3, 4)))
    assert gif.startswith(b"GIF89a")
    assert gif.count(b"\x21\xf9\x04") >= 2  # frames


def cells(name):
    """Overrides of every run of an experiment."""
    body = yaml.safe_load(schema.experiments()[name].read_text())
    swept = body["hydra"]["sweeper"]["params"]
    values = [[f"{key}={value}" for value in str(row).split(",")] for key, row in swept.items()]
    for one in body["cases"]:
        for combination in itertools.product(*values):
            yield [f"experiments={name}", *one.split(), *combination]


STUDIES = ("dynamic", "fields", "glued", "load_steps", "mls_disk", "radius", "rolling_fine")


@pytest.mark.parametrize(  # those beyond the figures of the paper have many cells
    "name",
    [
        slow_if(name.startswith(f"{PAPER}_fine/") or name.partition("/")[2] in STUDIES, name)
        for name in schema.experiments()
        if name.startswith(PAPER)
    ],
)
def test_experiments_apply(name):
    """Every run of every experiment is one that can be run."""
    found = compose.compose_many(list(cells(name)))
    assert len(found) >= 1
    for config, reason in found:
        assert reason == ""
        case.read(config)


@pytest.mark.parametrize(("advance", "answer"), [(0.5, HOLDS), (0.6, FAILS)])
def test_columns_with_another_weight_are_judged_on_the_coarse_mesh(
    tmp_path, write_run, advance, answer
):
    for name in ("MPM", "GMM-LME"):
        match = METHODS[name]
        scalars = {"final_run_out": 0.5}
        write_run(
            tmp_path / "soil", match["method"], match["basis"], 40, scalars=scalars, snapshot=False
        )
    other = HOLDS if answer == FAILS else FAILS
    for weight, mixed_terms, run_out in (
        ("gaussian", False, advance),
        ("cubic_spline", True, 1.1 - advance),
    ):
        chosen = {"name": "mls", "weight": weight, "degree": 1, "mixed_terms": mixed_terms}
        write_run(
            tmp_path / "mls_soil", "gmm", "mls", 40, scalars={"final_run_out": run_out},
            settings={"basis": chosen}, snapshot=False,
        )  # fmt: skip
    claim = next(claim for claim in find(PAPER).claims if claim.name == "columns")
    campaigns = read_campaigns(tmp_path)
    assert judge_in(claim, campaigns, SetUp("", {"weight": "gaussian"})).answer == answer
    assert judge_in(claim, campaigns, SetUp("", {"mixed_terms": True})).answer == other
    assert judge_in(claim, campaigns, SetUp("", {"degree": 2})).answer == UNDECIDED
    chosen = {"name": "mls", "weight": "cubic_spline", "degree": 2}
    write_run(
        tmp_path / "mls_soil", "gmm", "mls", 40, scalars={"final_run_out": 663.0},
        settings={"basis": chosen}, snapshot=False,
    )  # fmt: skip
    flung = judge_in(claim, read_campaigns(tmp_path), SetUp("", {"degree": 2}))
    assert flung.answer == FAILS
    assert "GMM-MLS flings a particle off the base" in flung.because
