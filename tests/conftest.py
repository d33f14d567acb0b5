"""Set up before anything imports numba: kernels compiled by the tests and by the program share one cache."""

import os

from mpmbench.runs.environment import prepare

prepare(os.environ)
