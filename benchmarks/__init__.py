"""Speed, measured by hand on a quiet machine."""

import os

from mpmbench.runs.process import environment

# As for a run: the linear algebra library gets one thread, since idle ones spin for a while and
# would count as CPU time of whatever runs then; and kernels come from the cache of these very
# sources, while numba's own place beside each file would not notice a change in what that calls.
environment.prepare(os.environ)
