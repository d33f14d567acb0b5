"""Set up before anything imports numba: kernels compiled by the tests and by the program share one cache."""

import atexit
import os
import shutil
import tempfile

from mpmbench.runs.process.environment import prepare

prepare(os.environ)
# Turns are taken among the runs of the tests, not with campaigns that happen to run on this
# machine.
os.environ["XDG_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="mpmbench-tests-")
atexit.register(shutil.rmtree, os.environ["XDG_RUNTIME_DIR"], ignore_errors=True)
