"""Speed, measured by hand on a quiet machine: ``python -m benchmarks`` prints everything, with ratios from one run."""

import os

# Idle threads of the linear algebra library spin for a while, which would count as CPU time of
# whatever runs then.
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ[f"{library}_NUM_THREADS"] = "1"
