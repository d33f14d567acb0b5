"""How long a run took, repeat by repeat, and how busy the machine was with other work meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np  # which a command of one run does without

# Attributes of the result file with one number for each repeat that had the machine to itself; not
# a number where the system did not tell. A run that is not timed has the load only.
UNITS = {
    "solver_times": "s, wall-clock time in the time steps",
    "solver_cpu_times": "s, CPU time of all threads in the time steps",
    "load_by_others": "processors that other processes kept busy during the run, on average",
    "steal": "processors that other guests of the host took during the run, on average",
}
BUSY = 0.2  # processors: what always runs in the background takes less
SAID = "; ".join(f"{name}: {text}" for name, text in UNITS.items())


@dataclass(frozen=True)
class Timings:
    """The repeats of one run; all arrays have their number, unknown values are not a number.

    Attributes
    ----------
    wall, cpu : ndarray
        Wall-clock and CPU time in the time steps [s].
    load, steal : ndarray
        Processors that were busy with other work, and processors that the host gave to others.
    """

    wall: "np.ndarray"
    cpu: "np.ndarray"
    load: "np.ndarray"
    steal: "np.ndarray"


def timings(attributes: Mapping[str, Any]) -> Timings:
    """The repeats that a result file's attributes tell of; older files know the first array only."""
    import numpy as np

    wall, *others = (np.atleast_1d(attributes.get(name, [])).astype(float) for name in UNITS)
    unknown = np.full(len(wall), np.nan)
    return Timings(wall, *(values if len(values) == len(wall) else unknown for values in others))


def load_of(attributes: Mapping[str, Any]) -> float:
    """Processors that were not there for a run, on average over its repeats; not a number if unknown."""
    import numpy as np

    load, steal = (
        np.atleast_1d(attributes.get(name, np.nan)).astype(float)
        for name in ("load_by_others", "steal")
    )
    return mean_of_known(load + steal) if len(load) == len(steal) else float("nan")


def mean_load(repeats: Sequence[Timings]) -> float:
    """The same over all repeats of several runs."""
    import numpy as np

    return mean_of_known(np.concatenate([np.zeros(0), *(one.load + one.steal for one in repeats)]))


def mean_of_known(values: "np.ndarray") -> float:
    """Mean of the finite values; not a number when there are none."""
    import numpy as np

    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def is_busy(load: float) -> bool:
    """Whether a load by others disturbs timings; an unknown one is not known to."""
    return load >= BUSY
