"""Sweeps on a real SLURM: Debian's, one node, controller and daemons of this test's own (as root)."""

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from mpmbench.results.netcdf import read_attributes
from tests.runs.conftest import start, waited

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scancel", "squeue")
CONFIGURATION = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={daemon}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1
KillWait=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={processors}
PartitionName=all Nodes={host} Default=YES State=UP
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.getuid() != 0, reason="its daemons are started as root"),
    pytest.mark.skipif(
        any(shutil.which(name, path=f"{os.defpath}:/usr/sbin") is None for name in PROGRAMS),
        reason="Debian's slurm-wlm and munge are not installed",
    ),
]


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Iterator[Path]:
    """A cluster of this machine alone; its folder."""
    pytest.importorskip("submitit")
    folder = tmp_path_factory.mktemp("cluster")
    folder.parent.chmod(0o755)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    host = socket.gethostname().partition(".")[0]
    text = CONFIGURATION.format(
        folder=folder, host=host, controller=free_port(), daemon=free_port(),
        processors=os.cpu_count(),
    )  # fmt: skip
    (folder / "slurm.conf").write_text(text)
    paths = [f"--{name}-file={folder}/munged.{name}" for name in ("log", "pid", "seed")]
    munge = ["munged", "--foreground", "--force", f"--socket={folder}/munge.socket"]
    commands = [
        [*munge, f"--key-file={key}", *paths],
        ["slurmctld", "-D", "-c"],
        ["slurmd", "-D", "-c"],
    ]
    daemons = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLURM_CONF", str(folder / "slurm.conf"))
        patch.setenv("PATH", f"{os.environ['PATH']}:/usr/sbin")
        patch.setenv("CUDA_VISIBLE_DEVICES", "")
        with open(folder / "daemons.log", "w") as log:
            try:
                for words in commands:
                    daemons.append(subprocess.Popen(words, stdout=log, stderr=log))
                    time.sleep(1)
                assert waited(lambda: "idle" in said("sinfo", "--noheader"), 60), log_of(folder)
                yield folder
            finally:
                for daemon in reversed(daemons):
                    daemon.terminate()
                    daemon.wait(20)


def said(*words: str) -> str:
    """What a program of SLURM prints."""
    return subprocess.run(words, capture_output=True, text=True).stdout


def log_of(folder: Path) -> str:
    """What the daemons have to say, for a failed test."""
    return "\n".join(file.read_text() for file in sorted(folder.glob("*.log")))


def running() -> list[str]:
    """Numbers of the jobs that compute."""
    return said("squeue", "--noheader", "--array", "--states=running", "--format=%A").split()


SWEEP = ("-m", "hydra/launcher=submitit_slurm", "hydra.launcher.timeout_min=10")


def test_a_sweep_runs_as_jobs_and_says_nothing_of_accounting(cluster, folder):
    process = start(*SWEEP, "resolution=4,5,6")
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, out + err + log_of(cluster)
    files = list((folder / "results/default").glob("*.nc"))
    assert len(files) == 3 and all(read_attributes(one)["status"] == "ok" for one in files)
    assert err == ""  # no accounting here, of which submitit warns at each look
    assert running() == []


def computing(folder: Path) -> list[str]:
    """Names of the runs that have begun, as the records of the sweep have them."""
    return [file.stem for file in (folder / "results").glob("*/*.running")]


def test_a_run_whose_job_is_cancelled_twice_has_crashed_and_the_same_command_completes_it(
    cluster, folder, plugins
):
    words = (*SWEEP, "problem=failing_bar", f"problem.flag_file={folder}/flag")
    process = start(*words, "problem.fault=held,none")
    cancelled: set[str] = set()

    def ended() -> bool:
        if list(folder.rglob("*.nc")) and computing(folder):  # the other one has its result
            for job in set(running()) - cancelled:
                said("scancel", job)
                cancelled.add(job)
        return process.poll() is not None

    assert waited(ended, 400), log_of(cluster)
    out, err = process.communicate()
    assert process.returncode == 1, out + err
    statuses = {
        one.stem: read_attributes(one)["status"]
        for one in (folder / "results/default").glob("*.nc")
    }
    assert sorted(statuses.values()) == ["crashed", "ok"], out + err
    (folder / "flag-free").touch()
    process = start(*words, "problem.fault=held,none")
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0 and "1 to run" in out, out + err
    assert {read_attributes(one)["status"] for one in folder.rglob("*.nc")} == {"ok"}


def test_an_interrupted_command_ends_its_jobs(cluster, folder, plugins):
    words = (*SWEEP, "problem=failing_bar", f"problem.flag_file={folder}/flag")
    process = start(*words, "problem.fault=held", "resolution=4,5")
    number = min(2, os.cpu_count() or 1)
    assert waited(lambda: len(computing(folder)) == number, 300), log_of(cluster)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=100)
    assert process.returncode == 1 and "interrupted" in err, out + err
    assert waited(lambda: running() == [], 60), said("squeue")
    statuses = {read_attributes(one)["status"] for one in folder.rglob("*.nc")}
    assert statuses == {"interrupted"}, out + err
