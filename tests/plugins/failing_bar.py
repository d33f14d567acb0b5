"""The vibrating bar with a fault that is built in: what the run layer must contain, name and survive."""

import os
import signal
import stat
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from mpmbench import Loads, NotApplicable, NotConverged, register
from mpmbench.core.errors import SolverFailure, require_option
from mpmbench.problems.bar_fixed_ends import BarFixedEnds

FAULTS = (
    "none", "raise", "not_finite", "negative_volume", "lost_basis", "hang", "hang_in_setup", "segfault", "killed",
    "exit", "memory", "not_converged", "not_applicable", "slow", "once", "garbage", "no_text", "own_status",
    "children", "memory_of_child", "hang_in_check", "exit_in_check", "no_variable",
    "long_garbage", "closed_pipe", "exit_silently", "long_text", "control_text", "recursion", "interrupt", "held",
)  # fmt: skip


class NoText(Exception):
    def __str__(self):
        raise RuntimeError("this exception has no text")


class Odd(SolverFailure):
    status = "odd"


@numba.njit(cache=True)
def spin(x):
    while x[0] == x[0]:
        x[0] += 1.0


@register("problem", "failing_bar")
@dataclass(frozen=True)
class FailingBar(BarFixedEnds):
    fault: str = "none"
    flag_file: str = "none"

    def __post_init__(self):
        super().__post_init__()
        require_option("fault", self.fault, FAULTS)

    def check(self, material, choices, basis, resolution):
        if self.fault == "not_applicable":
            raise NotApplicable("this fault does not apply")
        if self.fault == "exit_in_check":
            sys.exit(5)
        while self.fault == "hang_in_check":
            time.sleep(1)

    def fixed(self, x):
        return np.zeros(x.shape, dtype=bool) if self.fault == "lost_basis" else super().fixed(x)

    def velocity(self, X, material):
        v = super().velocity(X, material)
        if self.fault == "lost_basis":
            v[:] = 1e4
        return 1e6 * v if self.fault == "negative_volume" else v

    def loads(self, material):
        return Loads(body_force=self.misbehave)

    def misbehave(self, X, t, b):
        """Body force that is zero, and the place where the fault happens: at t = 0 also while compiling."""
        if self.fault == "hang_in_setup":
            spin(np.zeros(1))
        if t < 2e-4:
            return
        if self.fault == "not_finite":
            b[0] = np.nan
        if self.fault == "raise":
            raise ZeroDivisionError("a fault in a plug-in")
        if self.fault == "not_converged":
            raise NotConverged("the residual stays at 0.5")
        if self.fault in ("hang", "slow", "held") and self.flag_file != "none":
            Path(self.flag_file).write_text(str(os.getpid()))
        if self.fault == "hang":
            spin(np.zeros(1))
        if self.fault == "segfault":
            os.kill(os.getpid(), signal.SIGSEGV)
        if self.fault == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.fault == "exit":
            raise SystemExit(3)
        if self.fault == "memory":
            hoard = []
            while True:
                hoard.append(np.ones(2**20))
        if self.fault == "no_text":
            raise NoText
        if self.fault == "own_status":
            raise Odd("in its own words")
        if self.fault == "garbage":
            write_to_all_sockets(b"\0\x10\0\0 this is no message \xff\n")
        if self.fault == "long_garbage":
            write_to_all_sockets(2**20 * b"\xff")
        if self.fault == "closed_pipe":
            os.closerange(3, 256)
        if self.fault == "exit_silently":
            os._exit(0)
        if self.fault == "long_text":
            raise ValueError(2**20 * "long ")
        if self.fault == "control_text":
            raise ValueError("\x1b[2J\r\n\x00 \udc80 <script>")
        if self.fault == "recursion":
            self.misbehave(X, t, b)
        if self.fault == "interrupt":
            raise KeyboardInterrupt
        if self.fault in ("children", "memory_of_child"):
            self.start_children()
        if self.fault == "slow":
            time.sleep(0.01)
        while self.fault == "held" and not Path(f"{self.flag_file}-free").exists():
            time.sleep(0.01)
        if self.fault == "once" and not Path(self.flag_file).exists():
            Path(self.flag_file).touch()
            os.kill(os.getpid(), signal.SIGKILL)

    def quantities(self, solution, material):
        if self.fault == "no_variable":
            return {"oddity": (object(), "1", "no number")}
        return super().quantities(solution, material)

    def start_children(self):
        """One in our process group and one that has left it; either waits, or takes 400 MiB."""
        hoard = "b'x' * (400 * 2**20)" if self.fault == "memory_of_child" else "0"
        words = [sys.executable, "-c", f"import time; hoard = {hoard}; time.sleep(600)"]
        both = [subprocess.Popen(words, start_new_session=alone) for alone in (False, True)]
        Path(self.flag_file).write_text(" ".join(str(one.pid) for one in both))
        time.sleep(600)


def write_to_all_sockets(text):
    for descriptor in range(3, 256):
        try:
            if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                os.write(descriptor, text)
        except OSError:
            continue
