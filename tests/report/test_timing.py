"""Tables of times say whether the machine was busy, and go by the clock that it does not disturb."""

import numpy as np
import pytest

from mpmbench.report.series import studies
from mpmbench.report.timing import clock_of, timings
from mpmbench.results.records import read_campaign
from mpmbench.results.timings import Timings, mean_load
from mpmbench.results.timings import timings as repeats_of
from tests.support import edited

WALL, CPU = {"mpm": 2.0, "otm": 8.0}, {"mpm": 1.0, "otm": 1.5}


@pytest.fixture
def table(tmp_path, write_run):
    """The timing table of two runs with given load and context."""

    def make(load=None, cpu=True, context="exclusive"):
        for method in WALL:
            file = write_run(tmp_path, method, "linear", 8, timing_context=context, snapshot=False)
            with edited(file) as data:
                data["solver_time"][...] = WALL[method]
                if cpu:
                    data.createVariable("solver_cpu_time", "f8")[...] = CPU[method]
                if load is not None:
                    data.setncatts({"load_by_others": [load, load], "steal": [0.0, 0.2]})
        (study,) = studies(read_campaign(tmp_path))
        return timings(study)

    return make


def ratio_in(table):
    """OTM over MPM."""
    return next(row[2].value for row in table.rows if row[0].value.startswith("OTM"))


def test_on_a_quiet_machine_times_are_those_of_the_clock_on_the_wall(table):
    found = table(load=0.05)
    assert found.title == "Solver time" and ratio_in(found) == 4.0
    assert "Wall-clock times; the load by other work was 0.15 processors." in found.note


def test_under_load_the_head_says_so_and_ratios_are_of_cpu_times(table):
    found = table(load=1.3)
    head = "Solver time, CPU time, made under load: other work kept 1.40 processors busy"
    assert found.markdown().startswith(head) and ratio_in(found) == 1.5


def test_under_load_without_cpu_times_the_head_still_says_so(table):
    found = table(load=1.3, cpu=False)
    assert found.title.startswith("Solver time, made under load: other work kept 1.40")
    assert ratio_in(found) == 4.0 and "CPU times are unknown" in found.note


def test_older_files_tell_no_load(table):
    found = table(load=None, cpu=False)
    assert found.title == "Solver time" and ratio_in(found) == 4.0
    assert "the load by other work is unknown" in found.note


def test_times_of_runs_that_were_not_alone_are_indicative(table):
    found = table(load=0.05, context="shared")
    assert found.title == "Solver time, indicative only: the runs were not timed alone"
    assert "timing=exclusive" in found.note and ratio_in(found) == 4.0


def test_the_clock_goes_by_finished_runs(tmp_path, write_run):
    for status, load in (("ok", 1.0), ("diverged", 9.0)):
        file = write_run(tmp_path, "mpm" if status == "ok" else "otm", "linear", 8, status=status)
        with edited(file) as data:
            data.setncatts({"load_by_others": load, "steal": 0.0})
            if status == "ok":
                data.createVariable("solver_cpu_time", "f8")[...] = 1.0
    clock = clock_of(read_campaign(tmp_path).runs)
    assert clock.quantity == "solver_cpu_time" and "kept 1.00 processors" in clock.head


def test_repeats_of_older_files_have_no_cpu_time_and_no_load():
    old = repeats_of({"solver_times": 2.0})
    assert old.wall.tolist() == [2.0] and np.isnan([*old.cpu, *old.load, *old.steal]).all()
    new = Timings(np.ones(2), np.ones(2), np.array([1.0, np.nan]), np.array([0.5, 0.0]))
    assert np.isnan(mean_load([])) and np.isnan(mean_load([old]))
    assert mean_load([old, new]) == 1.5
