"""Set up before anything imports numba: kernels compiled by the tests and by the program share one cache."""

import os
import signal

from mpmbench.runs.environment import prepare

# A shell that runs the tests in the background makes them ignore interrupts, and with them the programs they start.
signal.signal(signal.SIGINT, signal.default_int_handler)


prepare(os.environ)
