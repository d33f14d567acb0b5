"""Bad input: one sentence that names the key, exit code 2, no traceback, no file left, nothing run."""

import os
import subprocess
import sys

import pytest

from mpmbench.core.registry import PACKAGE

BAD = [  # arguments, what the sentence must contain
    ("methd=otm", "did you mean method"),
    ("+basis.foo=1", "+basis.foo=1: keys can be neither added nor removed"),
    ("~basis", "neither added nor removed"),
    ("resolution=-3", "resolution = -3: a whole number of at least 1"),
    ("resolution=abc", "resolution = abc: a whole number"),
    ("resolution=2.5", "resolution = 2.5: a whole number"),
    ("resolution=1e9", "GiB, more than this machine's memory"),
    ("resolution=64 limits.memory=0.01", "GiB, more than limits.memory"),
    ("resolution=8,16", "several values need -m"),
    ("resolution=", "a value is needed after resolution="),
    ("resolution", "neither key=value nor a command"),
    ("time_step=0", "time_step = 0: a number greater than 0, or auto"),
    ("time_step=aut", "time_step = aut"),
    ("end_time=1e308 time_step=1e-308", "time_step = 1e-308: a size from 1e-60 to 1e+60"),
    (
        "end_time=1 time_step=1e-20",
        "end_time = 1 with time_step = 1e-20: these are 1e+20 time steps",
    ),
    ("problem.velocity_amplitude=1e308", "problem.velocity_amplitude = 1e+308: a size"),
    ("material.young_modulus=1e-300", "material.young_modulus = 1e-300: a size"),
    ("snapshot_times=[0,1e-100]", "snapshot_times = [0, 1e-100]: a size"),
    ("method.time=../x", "method.time = ../x: there is no such time loop; there are"),
    ("method.time=[1]", "method.time = [1]: there is no such time loop"),
    ("method.transfer=../x", "method.transfer = '../x': one of"),
    ("hydra.callbacks.a._target_=os.getcwd", "_target_ is refused"),
    ("method._target_=os.getcwd", "_target_ is refused"),
    ("-m resolution=4,8 hydra.launcher._target_=os.getcwd", "_target_ is refused"),
    ("end_time=nan", "end_time = nan: a number greater than 0"),
    ("threads=0", "threads = 0: a whole number from 1 to"),
    ("basis=maxent basis.d_max=0.5", "basis.d_max = 0.5: a number greater than 1"),
    (
        "basis=maxent basis.d_max=abc",
        "basis.d_max = abc: a number greater than 1, at most 10 is needed",
    ),
    ("basis=maxent basis.dmax=2", "did you mean basis.d_max"),
    ("basis=linear basis.degree=2", "the chosen basis has no degree, which belongs to bspline"),
    ("basis.d_max=[", "this value is not understood"),
    ("problem=bar_fixed_end", "did you mean bar_fixed_ends"),
    ("method=sph basis=kernel", "did you mean sph_kernel"),
    ("material.poisson_ratio=0.5", "material.poisson_ratio = 0.5"),
    ("material.young_modulus=inf", "material.young_modulus = inf: a finite number"),
    ("method=null", "there is no method null"),
    ("method={}", "a name is needed"),
    ("method.name=otm", "choose with method="),
    ("method.mass=lumpd", "method.mass = lumpd: one of lumped, kept, consistent"),
    ("on_error=stopp", "did you mean stop"),
    ("campaign=../elsewhere", "campaign = ../elsewhere"),
    ("output_dir=${nowhere}", "nowhere"),
    ("experiments=quickstrat", "did you mean quickstart"),
    ("experiments=a,b", "one experiment at a time"),
    ("--multirn", "did you mean --multirun"),
    ("--cfg", "--cfg needs a value"),
    ("--multirun --cfg job", "Only one of"),
    ("hydra.nonsense=1", "hydra.nonsense"),
    ("lst", "did you mean list"),
    ("report nowhere", "there is no such folder"),
    ("list bar", "no such option"),
    ("-m resolution=8,-3", "resolution = -3"),
    ("-m resolution=range(4,4)", "resolution=range(4,4): there is no value in this"),
    ("-m basis=glob(x*)", "basis=glob(x*): there is no value in this"),
    ("-m seed=range(0,1000000000)", "more than 1000000 runs in one sweep"),
    ("-m seed=range(0,2000) resolution=range(1,2000)", "more than 1000000 runs in one sweep"),
    ("--config-dir /nonexistent", "there is no such option; experiments and presets of your own"),
    ("--cfg jobs", "--cfg jobs: one of job, hydra, all is needed; did you mean job?"),
    ("--info=x", "--info x: one of all, config, defaults"),
    ("--resolve", "this goes with --cfg only"),
    ("resolution='8'", "resolution = '8': a whole number of at least 1 is needed, no text"),
    ("resolution=${oc.env:NOT_SET,4}", "write ${oc.decode:${oc.env:NAME}} where it comes from"),
    ("report='true'", "report = 'true': true, false or auto is needed, no text"),
    ("snapshot_times=[1e-4,2] end_time=1", "snapshot_times = 2: it comes after end_time = 1"),
    (
        "material.young_modulus=2kPa",
        "young_modulus = 2kPa: a number in Pa is needed, without a unit",
    ),
    ("material.poisson_ratio=30%", "poisson_ratio = 30%: a pure number is needed"),
    ("snapshots=0", "snapshots = 0: a whole number from 1 to 10000"),
    ("snapshots=2.5", "snapshots = 2.5: a whole number"),
    ("snapshot_every=2 end_time=1", "snapshot_every = 2: it is more than end_time = 1"),
    ("snapshot_every=1e-9 end_time=1", "these are 1000000000 instants, and at most 10000"),
    ("show nowhere", "there is no such file or folder"),
    ("show", "required: RESULT"),
    ("show x.nc --tme=3", "--tme=3: there is no such option; did you mean --time?"),
    ("animate x.nc --seconds=0", "--seconds=0: a number above 0"),
    ("campaign=" + 300 * "x", "file name too long"),
    ("output_dir=" + 300 * "x", "file name too long"),
    ("-m basis=linear,maxent basis.d_max=0.5", "basis.d_max = 0.5"),
    ("-m method=mpm,otn", "did you mean otm"),
]


@pytest.mark.parametrize(
    ("arguments", "sentence"), BAD, ids=[arguments[:60] for arguments, _ in BAD]
)
def test_bad_input_is_one_sentence_and_exit_code_2(command, folder, arguments, sentence):
    outcome = command(*arguments.split())
    assert outcome.code == 2
    assert outcome.err.startswith("mpmbench: ")
    assert outcome.err.count("\n") == 1
    assert sentence in outcome.err
    assert "Traceback" not in outcome.err
    assert outcome.out == ""
    assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_refused_before_the_run(command, folder):
    (folder / "results").write_text("not a folder")
    outcome = command("method=mpm")
    assert (outcome.code, "is not a folder" in outcome.err) == (2, True)
    assert (folder / "results").read_text() == "not a folder"


def test_a_link_that_leads_nowhere_is_refused_before_the_run(command, folder):
    (folder / "results").symlink_to(folder / "nowhere")
    outcome = command("method=mpm")
    assert (outcome.code, "results is a link: no such file" in outcome.err) == (2, True)


@pytest.mark.parametrize(
    ("name", "folder_name", "sentence"),
    [
        ("PYTHONOPTIMIZE", "here", "PYTHONOPTIMIZE, or python -O"),
        ("NUMBA_DISABLE_JIT", "here", "NUMBA_DISABLE_JIT: every method needs compiled kernels"),
        ("PYTHONUTF8", "fünf", "has no name in ascii; call it otherwise, or set LC_ALL=C.UTF-8"),
        ("REMOVED", "gone", "the current folder has been removed; change to another one"),
    ],
)
def test_an_environment_in_which_nothing_runs(folder, name, folder_name, sentence):
    """Programs of their own: `PYTHONUTF8=0` with `LC_ALL=C` is what older systems have."""
    (folder / folder_name).mkdir()
    value = "0" if name == "PYTHONUTF8" else "1"
    words = (
        f"cd {folder_name}; test $REMOVED && rmdir ../{folder_name}; {sys.executable} -m mpmbench"
    )
    outcome = subprocess.run(
        ["sh", "-c", f"{words} -m 'resolution=range(4,6)'"], cwd=folder, capture_output=True, text=True,
        env={**os.environ, "LC_ALL": "C", name: value, "PYTHONPATH": str(PACKAGE.parent)}, errors="replace",
    )  # fmt: skip
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert sentence in outcome.stderr and outcome.stderr.count("\n") == 1


def test_a_single_run_that_does_not_apply_is_bad_input(command, plugins, folder):
    outcome = command("problem=failing_bar", "problem.fault=not_applicable")
    assert outcome.code == 2
    assert "does not apply: this fault does not apply" in outcome.err
    assert list(folder.iterdir()) == []


def test_windows_is_refused_with_a_sentence(command, monkeypatch):
    monkeypatch.setattr("sys.platform", "win32")
    outcome = command("method=mpm")
    assert outcome.code == 2
    assert "Windows" in outcome.err
