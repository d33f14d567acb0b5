"""Two campaigns: what is found worse or better, and with which exit code; and several put into one."""

import shutil

import netCDF4
import numpy as np
import pytest

from mpmbench.commands import compare
from mpmbench.results import netcdf
from tests.runs.conftest import start

SWEEP = ("-m", "method=mpm,otm", "basis=linear", "resolution=4,8,16,32,64")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Ten real runs."""
    folder = tmp_path_factory.mktemp("campaign")
    process = start(*SWEEP, f"output_dir={folder}")
    assert process.wait() == 0
    return folder / "default"


@pytest.fixture
def both(campaign, folder):
    """Two copies of it, as if each run had been timed four times on a quiet machine."""
    for name in ("a", "b"):
        shutil.copytree(campaign, folder / name)
        noise = np.random.default_rng(ord(name)).normal(1.0, 0.01, (10, 4))
        for file, factors in zip(sorted((folder / name).glob("*.nc")), noise, strict=True):
            edit(file, solver_times=0.1 * factors)
    return folder / "a", folder / "b"


def edit(file, factor=None, **attributes):
    """Change attributes, and multiply the errors."""
    with netCDF4.Dataset(file, "a") as dataset:
        dataset.setncatts(attributes)
        for name in dataset.variables if factor else ():
            if name.startswith("error_"):
                dataset[name][...] = factor * float(dataset[name][...])


def test_a_campaign_is_the_same_as_itself(both, command):
    outcome = command("compare", "a", "b")
    assert outcome.code == 0
    assert outcome.out.splitlines()[0] == "10 runs in both, 0 only in A, 0 only in B"
    assert "failures: 10 same" in outcome.out and "10 same" in outcome.out.split("accuracy")[1]
    assert "speed (by more than 5%, p < 0.01): 2 same" in outcome.out


def test_new_failures_come_first_and_healed_ones_are_no_harm(both, command):
    first, second, *_ = sorted(both[1].glob("*.nc"))
    edit(first, status="diverged", reason="it blew up")
    edit(second, factor=2.0)
    there = command("compare", "a", "b")
    assert there.code == 12
    assert f"new        {first.name}" in there.out and "ok -> diverged: it blew up" in there.out
    back = command("compare", "b", "a")
    assert back.code == 0
    assert "1 healed" in back.out and "1 better" in back.out


def test_less_accuracy(both, command):
    files = sorted(both[1].glob("mpm-*-n16-*.nc"))
    edit(files[0], factor=1.005)
    assert command("compare", "a", "b").code == 0  # less than a percent
    edit(files[0], factor=1.5)
    outcome = command("compare", "a", "b")
    assert outcome.code == 11
    assert "1 worse" in outcome.out and "(+50.7%)" in outcome.out


def test_a_lower_order_alone_is_less_accurate(both, command):
    """Errors that became smaller on coarse grids only: every run is better, the order is worse."""
    for cells in (4, 8, 16, 32):
        for file in both[1].glob(f"mpm-*-n{cells}-*.nc"):
            edit(file, factor=(cells / 64) ** 0.7)
    outcome = command("compare", "a", "b")
    assert outcome.code == 11
    assert "4 better" in outcome.out.split("accuracy")[1].split("order")[0]
    assert "worse" in outcome.out.split("order (")[1].split("speed")[0]


def test_slower_on_one_machine_only(both, command):
    for file in both[1].glob("mpm-*.nc"):
        edit(file, solver_times=1.3 * np.array(netcdf.read_attributes(file)["solver_times"]))
    outcome = command("compare", "a", "b")
    assert outcome.code == 10
    assert "1 same, 1 worse" in outcome.out and "MPM" in outcome.out.split("speed")[1]
    assert "1 better" in command("compare", "b", "a").out
    for file in both[1].glob("*.nc"):
        edit(file, host="another")
    outcome = command("compare", "a", "b")
    assert outcome.code == 0
    assert "left out   10 runs on different machines" in outcome.out


def test_shared_timings_are_no_timings(both, command):
    for file in both[1].glob("*.nc"):
        with netCDF4.Dataset(file, "a") as dataset:
            dataset.delncattr("solver_times")
    assert "left out   10 runs not timed alone" in command("compare", "a", "b").out


def test_what_cannot_be_compared(both, command, folder):
    for file in both[1].glob("*.nc"):
        edit(file, config_hash="f" * 16)
    outcome = command("compare", "a", "b")
    assert (outcome.code, outcome.out) == (20, "not comparable: no configuration is in both\n")
    edit(next(iter(both[1].glob("*.nc"))), schema_version=99)
    assert command("compare", "a", "b").code == 20
    assert command("compare", "a").code == 2
    assert "is not a folder" in command("compare", "a", "nowhere").err


def test_the_rank_test_finds_a_fifth_and_rarely_nothing():
    """With 3 configurations x 4 repeats and 5 % noise: false alarms are rare, a fifth slower is found."""
    rng = np.random.default_rng(0)

    def verdicts(factor: float) -> list[str]:
        found = []
        for _ in range(200):
            scale = np.log([0.01, 0.1, 1.0])[:, None]
            a, b = (scale + rng.normal(0.0, 0.05, (3, 4)) for _ in range(2))
            found.append(compare.rank_test(list(zip(a, b + np.log(factor), strict=True)), 0.01)[0])
        return found

    assert verdicts(1.0).count("same") >= 196
    assert verdicts(1.2).count("worse") >= 196
    few = [(np.log([1.0, 1.1]), np.log([2.0, 2.1]))]
    assert compare.rank_test(few, 0.01)[0] == "undecided"


def test_merge_takes_what_is_better_and_loses_nothing(both, command, folder):
    a, b = both
    names = sorted(file.name for file in a.glob("*.nc"))
    (a / names[0]).unlink()
    edit(a / names[1], status="timeout", reason="too slow")
    edit(b / names[2], status="crashed", reason="gone")
    before = {file: file.read_bytes() for file in b.glob("*.nc")}
    outcome = command("merge", "a", "b")
    assert outcome.code == 0
    assert outcome.out.splitlines()[-1] == "a: 1 copied, 1 replaced, 8 kept, 0 left out"
    assert f"replaced: {names[1]}: timeout of" in outcome.out
    assert {netcdf.read_attributes(file)["status"] for file in a.glob("*.nc")} == {"ok"}
    assert {file: file.read_bytes() for file in b.glob("*.nc")} == before
    assert (
        command("merge", "new/folder", "a", "b")
        .out.splitlines()[-1]
        .endswith("10 copied, 0 replaced, 10 kept, 0 left out")
    )


def test_merge_leaves_broken_files_out_and_names_them(both, command, folder):
    a, b = both
    names = sorted(file.name for file in a.glob("*.nc"))
    whole = (a / names[0]).read_bytes()
    (b / names[0]).write_bytes(whole[: len(whole) // 2])
    edit(b / names[1], config_hash="f" * 16)
    outcome = command("merge", "a", "b")
    assert outcome.code == 1
    assert f"left out: b/{names[0]}: not a readable result" in outcome.out
    assert f"left out: b/{names[1]}: another configuration has its name in a" in outcome.out
    assert (a / names[0]).read_bytes() == whole
    for arguments in (
        ("merge", "a"),
        ("merge", "a", "nowhere"),
        ("merge", "a", "a"),
        ("merge", "a", "."),
    ):
        outcome = command(*arguments)
        assert outcome.code == 2 and outcome.err.count("\n") == 1
