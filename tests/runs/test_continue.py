"""A run that goes on from the end of a stored one."""

import json

import numpy as np
import pytest

from mpmbench.case import build, read
from mpmbench.case.build import step_size
from mpmbench.core.end_state import as_numbers, from_numbers
from mpmbench.core.simulation import simulate
from mpmbench.results import netcdf
from mpmbench.runs.hydra.compose import compose_many
from tests.support import edited, slow_if

CLOCKS = {"solver_time", "solver_cpu_time", "compile_time", "wall_time", "peak_memory"}
# What history says depends on its instants, and those of the shorter run are kept.
OF_HISTORY = {"energy_drift", "energy_imbalance", "momentum_drift"}
METHODS = {
    "explicit, grid": ("method=mpm", "basis=bspline", "resolution=4", "time_step=1e-5"),
    "explicit, moving nodes": (
        *("method=otm", "method.volumetric=f_bar", "basis=maxent"),
        *("resolution=4", "time_step=1e-5"),
    ),
    "implicit": ("method=implicit_mpm", "resolution=4", "time_step=1e-5"),
}


def new_file(folder, known=()):
    (file,) = set(folder.rglob("*.nc")) - set(known)
    return file


@pytest.mark.parametrize(  # one method by default, on a grid; the others are compiled for it
    "method", [slow_if(method != "explicit, grid", method) for method in METHODS]
)
def test_the_bits_are_those_of_a_run_from_the_start(method, command, folder):
    words = METHODS[method]
    assert command(*words, "end_time=1e-4", "snapshot_times=[3e-5]").code == 0
    short = new_file(folder)
    outcome = command("continue", str(short), "end_time=2.6e-4", "snapshot_times=[1e-4,2e-4]")
    assert (outcome.code, outcome.err) == (0, "")
    file = new_file(folder, [short])
    went_on = netcdf.load(file)
    assert command(*words, "end_time=2.6e-4", "snapshot_times=[3e-5,1e-4,2e-4]").code == 0
    assert new_file(folder, [short]) == file  # the same run, which a sweep finds finished
    whole = netcdf.load(file)
    assert (went_on.continued_from, "continued_from" in whole.attrs) == (short.name, False)
    assert set(went_on.variables) == set(whole.variables)
    compared = 0
    for name in set(map(str, whole.variables)) - CLOCKS - OF_HISTORY:
        ours, theirs = went_on[name], whole[name]
        if "time" in ours.dims:
            ours, theirs = ours.isel(time=-1), theirs.isel(time=-1)
        assert ours.values.tobytes() == theirs.values.tobytes(), name
        compared += 1
    assert compared > 25 and whole.steps == 26 and len(whole.snapshot_time) == 5
    first = netcdf.load(short)
    assert np.array_equal(went_on.time[: len(first.time)], first.time)  # the history is kept
    assert np.all(np.diff(went_on.time) > 0.0)


def test_a_continued_run_is_what_a_run_from_the_start_gives(command, folder):
    assert command(*METHODS["explicit, grid"], "end_time=1e-4").code == 0
    short = new_file(folder)
    assert command("continue", str(short), "end_time=2e-4").code == 0
    file = new_file(folder, [short])
    outcome = command("rerun", str(file))
    assert outcome.code == 0 and "bitwise equal" in outcome.out
    with edited(file) as dataset:
        dataset["velocity"][-1, 0] *= 1.001
    assert ": different" in command("rerun", str(file)).out


def test_a_step_found_automatically_stays_that_of_the_stored_run(command, folder):
    assert command("resolution=4", "time_step=auto", "end_time=1e-3").code == 0
    short = new_file(folder)
    step = netcdf.read_attributes(short)["time_step"]
    steps = 3 * round(1e-3 / step)
    outcome = command("continue", str(short), f"end_time={steps * step!r}")
    assert outcome.code == 0, outcome.err
    attributes = netcdf.read_attributes(new_file(folder, [short]))
    assert attributes["time_step"] == json.loads(attributes["config"])["time_step"] == step
    outcome = command("continue", str(short), f"end_time={1e-3 + 1.5 * step!r}")
    assert outcome.code == 2 and "whole steps of" in outcome.err


def test_what_cannot_have_the_same_bits_is_refused_with_the_reason(command, folder):
    assert command("resolution=4", "time_step=1e-5", "end_time=1e-4").code == 0
    file = new_file(folder)
    for words, said in (
        (["end_time=1e-4"], "more than 0.0001 s is needed, where it ends"),
        (["end_time=-1"], "end_time = -1"),
        ([], "end_time is needed"),
        (["end_time=2e-4", "resolution=8"], "all else is the stored run's"),
        (["end_time=2e-4", "snapshot_times=[5e-5]"], "instants from 0.0001 s"),
    ):
        outcome = command("continue", str(file), *words)
        assert outcome.code == 2 and said in outcome.err, outcome.err
    with edited(file) as dataset:
        kept = dataset.code_files, dataset.numpy_version
        code = json.loads(dataset.code_files)
        code["core/transfer/__init__.py"] = "other"
        dataset.code_files, dataset.numpy_version = json.dumps(code), "1.0"
    outcome = command("continue", str(file), "end_time=2e-4")
    assert outcome.code == 2
    assert "core/transfer/__init__.py, numpy 1.0 -> " in outcome.err
    for text, said in (("{}", "cannot be read"), ("[", "cannot be read")):
        with edited(file) as dataset:
            dataset.code_files, dataset.numpy_version = kept
            places = dataset["end_state_places"]
            written = np.full(places.shape, ord(" "), dtype=np.uint8)
            written[: len(text)] = list(text.encode())
            places[...] = written
        outcome = command("continue", str(file), "end_time=2e-4")
        assert outcome.code == 2 and said in outcome.err, outcome.err
    assert new_file(folder) == file  # nothing was left
    with edited(file) as dataset:
        dataset.status = "diverged"
    outcome = command("continue", str(file), "end_time=2e-4")
    assert outcome.code == 2 and "has not come to its end: diverged" in outcome.err


def test_numbers_that_are_none_end_the_run_and_not_the_program(command, folder):
    assert command("resolution=4", "time_step=1e-5", "end_time=1e-4").code == 0
    file = new_file(folder)
    with edited(file) as dataset:
        dataset["end_state"][:] = np.nan
    outcome = command("continue", str(file), "end_time=2e-4")
    assert outcome.code == 1 and "diverged" in outcome.out


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        *(
            f"problem=bar_fixed_ends resolution=8 {words}"
            for words in (
                "method=mpm basis=linear",
                "method=mpm basis=bspline method.transfer=xpic",
                "method=mpm basis=bspline method.transfer=fmpm method.stress_update=musl",
                "method=mpm basis=bspline method.gradient=affine",
                "method=mpm basis=gimp method.transfer=apic",
                "method=mpm basis=cpdi",
                "method=mpm basis=ddmp",
                "method=unified basis=bspline",
                "method=unified basis=lme",
                "method=unified basis=mls",
                "method=unified basis=rkpm",
                "method=otm basis=maxent",
                "method=tlmpm",
                "method=ulmpm",
                "method=moving_mesh_mpm",
                "method=efg",
            )
        ),
        "problem=bar_dynamic_traction method=otm basis=maxent resolution=8",
        "problem=plate_axis_aligned method=mpm method.mass=consistent basis=bspline resolution=4",
        "problem=plate_axis_aligned method=unified basis=linear method.mass=consistent resolution=4",
        "problem=cantilever_dynamic resolution=4",
        "problem=cantilever_dynamic method=gmm basis=lme resolution=4",
        "problem=cantilever_dynamic method=fem resolution=4",
        "problem=two_squares contact=multi_field resolution=8",
        "problem=two_squares contact=penalty resolution=8",
        "problem=bouncing_disk resolution=4",
        "problem=rolling_disk method=gmm basis=lme resolution=4",
        "problem=friction_slope resolution=4",
        "problem=soil_column resolution=4",
        "problem=elastic_bar_tension resolution=4",
    ],
)
def test_every_kind_of_state_is_kept_whole(words):
    """Six steps, and six more, against twelve: the fields of particles have the same bits."""
    ((config, reason),) = compose_many([words.split()])
    assert not reason
    case = read(config)
    step = step_size(config, case, build(case))
    assert isinstance(step, float)
    short = simulate(build(case), step, 6 * step, [2 * step])
    kept = from_numbers(*as_numbers(short.end_state()))
    instants = [2 * step, 6 * step]
    went_on, whole = (
        simulate(build(case), step, 12 * step, instants, before=before) for before in (kept, None)
    )
    assert (went_on.status, went_on.steps) == (whole.status, 12) == ("ok", 12)
    assert went_on.cell_crossings == whole.cell_crossings
    assert len(went_on.snapshots) == len(whole.snapshots) == 4
    for ours, theirs in zip(went_on.snapshots, whole.snapshots, strict=True):
        for name in theirs:
            assert np.asarray(ours[name]).tobytes() == np.asarray(theirs[name]).tobytes(), name
