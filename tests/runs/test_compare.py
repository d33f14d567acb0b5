"""Two campaigns: what is found worse or better, and with which exit code; and several put into one."""

import platform
import re
import shutil

import numpy as np
import pytest

from benchmarks import power
from mpmbench.commands.compare import ratio
from mpmbench.commands.compare.ratio import QUIET
from mpmbench.results import netcdf
from tests.runs.conftest import start
from tests.support import edited, unbroken

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
            quiet = {name: [0.01] * 4 for name in ("load_by_others", "steal")}
            edit(file, solver_times=0.1 * factors, solver_cpu_times=0.1 * factors, **quiet)
    return folder / "a", folder / "b"


def edit(file, factor=None, **attributes):
    """Change attributes, and multiply the errors."""
    with edited(file) as dataset:
        dataset.setncatts(attributes)
        for name in dataset.variables if factor else ():
            if name.startswith("error_"):
                dataset[name][...] = factor * float(dataset[name][...])


def test_a_campaign_is_the_same_as_itself(both, command):
    outcome = command("compare", "a", "b")
    assert outcome.code == 0
    assert outcome.out.splitlines()[0] == "10 runs in both, 0 only in A, 0 only in B"
    assert "failures: 10 same" in outcome.out and "10 same" in outcome.out.split("accuracy")[1]
    assert speed_of(outcome.out)[0].endswith(": 2 same")


def test_new_failures_come_first_and_healed_ones_are_no_harm(both, command):
    first, second, *_ = sorted(both[1].glob("*.nc"))
    edit(first, status="diverged", reason="it blew up")
    edit(second, factor=2.0)
    there = command("compare", "a", "b")
    assert there.code == 12
    assert f"new        {first.name}" in there.out
    assert "ok -> diverged: it blew up" in unbroken(there.out)
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


@pytest.mark.slow  # by default the error of one run
def test_a_lower_order_alone_is_less_accurate(both, command):
    """Errors that became smaller on coarse grids only: every run is better, the order is worse."""
    for cells in (4, 8, 16, 32):
        for file in both[1].glob(f"mpm-*-n{cells}-*.nc"):
            edit(file, factor=(cells / 64) ** 0.7)
    outcome = command("compare", "a", "b")
    assert outcome.code == 11
    assert "4 better" in outcome.out.split("accuracy")[1].split("order")[0]
    assert "worse" in outcome.out.split("order (")[1].split("speed (")[0]


def slow_down(folder, factor, pattern="*.nc"):
    """Multiply the wall-clock times of some runs."""
    for file in folder.glob(pattern):
        edit(file, solver_times=factor * np.array(netcdf.read_attributes(file)["solver_times"]))


def speed_of(out):
    """The lines about speed, whole, which have 80 columns at most."""
    assert max(map(len, out.splitlines())) <= 80
    return ("speed (" + unbroken(out).split("speed (")[1]).splitlines()


@pytest.mark.parametrize("factor", [pytest.param(1.5, marks=pytest.mark.slow), 3.0])
def test_slower_campaigns_are_worse_and_the_ratio_is_told(both, command, factor):
    slow_down(both[1], factor)
    outcome = command("compare", "a", "b")
    assert outcome.code == 10
    head, *lines = speed_of(outcome.out)
    assert head.endswith("97.5% each): 2 worse")  # 5 % over two groups
    assert len(lines) == 3 and "all runs   worse (95%)" in lines[-1]
    assert "CPU time x 1.00" in lines[-1]
    for line in lines:
        found, low, high = (float(part) for part in re.findall(r"\d\.\d{3}", line)[:3])
        assert low < found < high and found == pytest.approx(factor, rel=0.02)
        assert "4 and 4 repeats" in line
    back = command("compare", "b", "a")
    assert back.code == 0 and "2 better" in back.out


@pytest.mark.slow  # by default three times slower, and what is undecided
def test_a_little_slower_is_undecided_or_worse_but_never_the_same(both, command):
    slow_down(both[1], 1.07)
    outcome = command("compare", "a", "b")
    assert outcome.code in (10, 30) and "same" not in " ".join(speed_of(outcome.out)[1:])


def test_one_slower_method_is_not_lost_among_the_others(both, command):
    """Of fifteen runs three: the median over all of them does not see it."""
    slow_down(both[1], 1.5, "mpm-*-n[48]-*.nc")
    for folder in both:
        for cells in (16, 32, 64):
            next(folder.glob(f"mpm-*-n{cells}-*.nc")).unlink()
    outcome = command("compare", "a", "b")
    assert outcome.code == 10
    head, *lines = speed_of(outcome.out)
    assert "1 same, 1 worse" in head and "all runs   worse" not in lines[-1]


def test_what_too_few_or_scattered_times_leave_undecided(both, command):
    """Two runs: a factor of three is seen, noise of 50 % hides 1.5, and single times say nothing."""
    for folder in both:
        for file in sorted(folder.glob("*.nc"))[2:]:
            file.unlink()
    slow_down(both[1], 3.0)
    assert command("compare", "a", "b").code == 10
    slow_down(both[1], 0.5)
    noise = np.random.default_rng(1)
    for folder in both:
        for file in folder.glob("*.nc"):
            times = netcdf.read_attributes(file)["solver_times"]
            edit(file, solver_times=times * np.exp(noise.normal(0.0, 0.5, 4)))
    outcome = command("compare", "a", "b")
    number = re.search(r"about (\d+) repeats would decide", unbroken(outcome.out))
    assert outcome.code == 30 and number is not None and int(number[1]) > 4
    for folder in both:
        for file in folder.glob("*.nc"):
            edit(file, solver_times=0.1, load_by_others=0.0, steal=0.0)
    slow_down(both[1], 3.0)
    outcome = command("compare", "a", "b")
    assert outcome.code == 30 and "about 2 repeats would decide" in unbroken(outcome.out)


@pytest.mark.slow  # four comparisons; what decides little is asked above
def test_times_under_load_decide_little_and_say_so(both, command):
    for file in both[0].glob("*.nc"):
        edit(file, load_by_others=[np.nan] * 4)
    assert "load by other work unknown, taken as none" in command("compare", "a", "b").out
    for file in both[1].glob("*.nc"):
        edit(file, load_by_others=[1.0] * 4, steal=[0.1] * 4)
    outcome = command("compare", "a", "b")
    assert outcome.code == 30
    said = "under load (processors busy with other work: unknown before, 1.10 after)"
    assert said in unbroken(outcome.out)
    slow_down(both[1], 1.5)
    assert command("compare", "a", "b").code == 30
    slow_down(both[1], 2.0)
    assert command("compare", "a", "b").code == 10


@pytest.mark.slow  # two comparisons; what cannot be compared is asked below
def test_times_of_other_machines_or_not_alone_are_no_comparable_times(both, command):
    for file in both[1].glob("mpm-*.nc"):
        edit(file, host="another", threads=2)
    outcome = command("compare", "a", "b")
    assert outcome.code == 0
    assert "1 no comparable times, 1 same" in speed_of(outcome.out)[0]
    why = r"5 runs on different machines \(host: \S+, another; threads: 1, 2\)"
    assert re.search(why, unbroken(outcome.out))
    for file in both[1].glob("*.nc"):
        with edited(file) as dataset:
            dataset.delncattr("solver_times")
            dataset.setncatts({"host": platform.node(), "threads": 1})
    outcome = command("compare", "a", "b")
    assert outcome.code == 0
    assert "2 no comparable times" in speed_of(outcome.out)[0]
    assert "5 runs not timed alone (timing=exclusive)" in unbroken(outcome.out)
    assert "same" not in " ".join(speed_of(outcome.out)[1:])


def test_what_cannot_be_compared(both, command, folder):
    for number, file in enumerate(both[1].glob("*.nc")):
        config = netcdf.read_attributes(file)["config"]
        assert '"time_step":1e-05' in config
        changed = config.replace('"time_step":1e-05', '"time_step":2e-05')
        edit(file, config_hash=f"{number:016}", config=changed)
    outcome = command("compare", "a", "b")
    said = "they differ in time_step (1e-05 in A, 2e-05 in B)"
    assert outcome.code == 20
    assert unbroken(outcome.out) == f"not comparable: no configuration is in both; {said}\n"
    for file in both[1].glob("*.nc"):
        edit(file, schema_version=99)
    outcome = command("compare", "a", "b")
    assert outcome.code == 20
    assert "schema_version = 99: one of 1, 2, 3, 4 is needed" in unbroken(outcome.out)
    assert command("compare", "a").code == 2
    assert "is not a folder" in command("compare", "a", "nowhere").err


@pytest.mark.parametrize("machine", power.NOISES)
def test_false_alarms_are_rare_and_half_as_slow_again_is_found(machine, monkeypatch):
    """The study of the documentation for the shape of quickstart's campaign, with fewer samples."""
    monkeypatch.setattr(power, "SAMPLES", 200)
    noise, shape = power.NOISES[machine], power.SHAPES["quickstart"]
    equal = power.shares(noise, shape, 7)
    assert equal["worse"] + equal["better"] < 0.05
    if noise.allowance > QUIET:
        assert equal["undecided"] > 0.95
    else:
        assert power.shares(noise, shape, 7, 1.5)["worse"] > 0.99
        one = power.shares(noise, shape, 7, 1.5, slower_groups=1)["worse"]
        assert one > (0.95 if noise.own < 0.1 else 0.7)


def test_the_very_same_times_are_the_same_however_they_scatter():
    times = np.random.default_rng(0).normal(0.0, 1.0, (4, 3))
    assert ratio.judge({"all": list(zip(times, times, strict=True))})[2] == "same"
    moved = list(zip(times, times + 1e-9, strict=True))
    assert ratio.judge({"all": moved})[2] == "undecided"


def test_an_interval_holds_as_often_as_it_says():
    """Of 400 intervals of 90 %, for times whose noise is that of their rounds, about 360 hold."""
    random = np.random.default_rng(0)
    noise = power.Noise(0.0, 0.03, 0.01, 0.0)
    held = 0
    for _ in range(400):
        before, after = (power.timings(random, noise, 3, 4) for _ in range(2))
        found = ratio.ratio_of(list(zip(before, after, strict=True)), 0.9)
        held += abs(found.shift) < found.half_width
    assert 340 <= held <= 380


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
    said = unbroken(outcome.out)
    assert f"left out: b/{names[0]}: was changed after it had been written" in said
    assert f"left out: b/{names[1]}: another configuration has its name in a" in said
    assert (a / names[0]).read_bytes() == whole
    for arguments in (
        ("merge", "a"),
        ("merge", "a", "nowhere"),
        ("merge", "a", "a"),
        ("merge", "a", "."),
    ):
        outcome = command(*arguments)
        assert outcome.code == 2 and outcome.err.count("\n") == 1
