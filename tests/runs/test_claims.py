"""Several processes that want the same runs: each run is done once, and where there are no locks, nothing breaks."""

import errno
import fcntl
import re

import pytest

from mpmbench.runs.process import exclusive, locks
from mpmbench.runs.sweep import claims
from tests.runs.conftest import start

SWEEP = ("-m", "resolution=4,5,6,7,8", "campaign=shared")


def test_a_run_is_one_process_s_until_it_ends(tmp_path):
    """Locks tell open files apart as they tell processes apart."""
    target = tmp_path / "campaign" / "run.nc"
    with claims.claimed(target) as first, claims.claimed(target, wait=False) as second:
        assert (first, second) == (True, False)
    with claims.claimed(target, wait=False) as third:
        assert third
    assert list(target.parent.iterdir()) == []


def test_a_holder_that_removes_its_mark_gives_way_to_one_only(tmp_path):
    """Who has opened the file before it was removed must not take it for the new one."""
    mark = claims.mark_of(tmp_path / "run.nc")
    late = mark.open("a")
    mark.unlink()
    assert claims.take(mark) is not None and not claims.is_the_same(late, mark)


def test_marks_of_processes_that_were_killed_are_removed(tmp_path):
    left, held = (claims.mark_of(tmp_path / name) for name in ("left.nc", "held.nc"))
    left.touch()
    with claims.claimed(tmp_path / "held.nc"):
        claims.remove_leftovers(tmp_path)
        assert list(tmp_path.iterdir()) == [held]


@pytest.fixture(params=("ENOLCK", "ENOSYS", "EOPNOTSUPP"))
def no_locks(request, monkeypatch):
    """A disk without locks."""

    def refuse(*_):
        raise OSError(getattr(errno, request.param), "no locks here")

    monkeypatch.setattr(fcntl, "flock", refuse)
    locks.say_refused.cache_clear()


def test_without_locks_work_may_be_done_twice_and_that_is_said(no_locks, tmp_path, capfd):
    with claims.claimed(tmp_path / "a.nc") as first, claims.claimed(tmp_path / "a.nc") as second:
        assert first and second
    said = capfd.readouterr().err
    assert said.startswith(f"mpmbench: {tmp_path} has no locks for files: processes that want")
    assert said.count("\n") == 1 and list(tmp_path.iterdir()) == []


def test_without_locks_no_timing_counts(no_locks, capfd):
    with exclusive.turn(alone=True) as began:
        assert not exclusive.undisturbed_since(began)
    assert "runs do not wait for one another, and no timing counts" in capfd.readouterr().err


def test_without_locks_all_slots_are_free(no_locks, tmp_path):
    with exclusive.slot(tmp_path, 1), exclusive.slot(tmp_path, 1):
        pass


def test_two_equal_sweeps_at_once_share_the_runs(folder):
    """A run that the other one has done takes no time."""
    both = [start(*SWEEP), start(*SWEEP)]
    outputs = [process.communicate(timeout=300) for process in both]
    assert [process.returncode for process in both] == [0, 0], outputs
    lines = re.findall(r"^\[\d/\d\] ok .* ([\d.]+) s ", "\n".join(out for out, _ in outputs), re.M)
    done = [line for line in lines if float(line) > 0.0]
    assert len(done) == 5, outputs
    assert len(list(folder.rglob("*.nc"))) == 5
    assert {path.suffix for path in (folder / "results/shared").iterdir()} == {".nc"}
