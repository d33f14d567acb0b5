"""The vibrating bar with a fault that is built in: what the run layer must contain, name and survive."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from mpmbench import Loads, NotApplicable, NotConverged, register
from mpmbench.core.errors import require_option
from mpmbench.problems.bar_fixed_ends import BarFixedEnds

FAULTS = (
    "none", "raise", "not_finite", "negative_volume", "lost_basis", "hang", "hang_in_setup", "segfault", "killed",
    "exit", "memory", "not_converged", "not_applicable", "slow", "once",
)  # fmt: skip


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
        if self.fault in ("hang", "slow") and self.flag_file != "none":
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
        if self.fault == "slow":
            time.sleep(0.01)
        if self.fault == "once" and not Path(self.flag_file).exists():
            Path(self.flag_file).touch()
            os.kill(os.getpid(), signal.SIGKILL)
