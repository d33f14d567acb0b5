"""The door for Python: one run and a sweep, as on the command line.

Results, files and limits are those of the command line: every run has a process of its own and
leaves its file, and what has been computed before is read instead of computed again.
"""

import re
import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from mpmbench.report.notebook import Result
from mpmbench.results import netcdf
from mpmbench.results.campaign import Cube, cube_of
from mpmbench.results.identity import result_path
from mpmbench.runs.hydra import compose
from mpmbench.runs.streams import forgiving
from mpmbench.runs.sweep import session
from mpmbench.runs.sweep.claims import run_once
from mpmbench.runs.sweep.plan import make_plan
from mpmbench.say import say
from mpmbench.settings import arguments
from mpmbench.settings.schema import BadInput
from mpmbench.settings.words import in_yaml

SAY_AFTER, SAY_EVERY = 2.0, 5.0  # seconds: of a run before its first line, and between two


def run(*overrides: str, **settings: Any) -> Result:
    """Run one case, or read its result where there is one already.

    Parameters
    ----------
    *overrides : str
        Settings as on the command line, for example ``"method.mass=lumped"``.
    **settings
        The same by name, with two underscores for a dot: ``method="otm", method__mass="lumped"``.

    Returns
    -------
    Result
        An `xarray.Dataset` of what the result file holds, which shows itself in a notebook, and
        any of its fields by ``show("von_mises")``; the attribute ``status`` is ``ok`` or says how the run
        failed, ``reason`` why, ``file`` where it lies. Times are numbers of seconds.

    Raises
    ------
    BadInput
        When a setting is wrong or the combination does not apply; nothing has run then.

    Examples
    --------
    >>> result = mpmbench.run(method="otm", basis="maxent", resolution=16)   # doctest: +SKIP
    >>> float(result.error_displacement_rms)                                 # doctest: +SKIP
    """
    words = [*overrides, *(f"{_key(key)}={_word(value)}" for key, value in settings.items())]
    _, pairs = arguments.split(words, [])
    if compose.wants_many([], pairs):
        raise BadInput("this experiment is a sweep: mpmbench.sweep runs it")
    plan = make_plan(compose.compose_many([pairs]))
    (cell,) = plan.cells()
    if cell.unchecked is not None:
        raise BadInput(f"the configuration could not be checked: {cell.unchecked.reason}")
    if cell.not_applicable:
        raise BadInput(f"this combination does not apply: {cell.not_applicable}")
    file = result_path(cell.config)
    if plan.to_run:
        with forgiving():
            record = run_once(cell.config, cell.stamp, progress(file.stem))
        if record is not None and record.unwritten:
            raise OSError(record.unwritten)
    return Result.of(netcdf.load(file)).assign_attrs(file=str(file))


def sweep(*overrides: str, **settings: Any) -> Cube:
    """Run all combinations of settings, as far as they are missing.

    Parameters
    ----------
    *overrides, **settings
        As those of `run`; a list, a tuple or a range gives several values:
        ``method=["mpm", "otm"], resolution=[8, 16, 32]``. ``experiments="quickstart"`` runs an
        experiment.

    Returns
    -------
    Cube
        As `open_campaign` gives it, of the runs of this sweep. A run that failed or does not apply
        is in it, with its status and reason.

    Raises
    ------
    BadInput
        When any setting is wrong; nothing has run then.
    """
    words = [*overrides, *(f"{_key(key)}={_values(key, value)}" for key, value in settings.items())]
    _, pairs = arguments.split(["-m", *words], [])
    of_this = session.Session(pairs)
    of_this.run()
    return cube_of(result_path(cell.config) for cell in of_this.plan.cells())


def progress(name: str) -> Callable[[float, float], None]:
    """A function that says in plain lines how far a run is, once it has taken a while."""
    last = time.monotonic() - SAY_EVERY + SAY_AFTER

    def tell(fraction: float, simulation_time: float) -> None:
        nonlocal last
        if time.monotonic() - last > SAY_EVERY:
            last = time.monotonic()
            say(f"{name}: {fraction:.0%}, t = {simulation_time:.4g} s")

    return tell


def _key(name: str) -> str:
    return name.replace("__", ".")


def _values(name: str, value: Any) -> str:
    """Several values of a setting as a choice on the command line, one value as itself."""
    several = isinstance(value, Iterable) and not isinstance(value, str)
    if several and name == "snapshot_times":  # one value of it is a list
        several = any(isinstance(one, Iterable) for one in value)
    return ",".join(_word(one) for one in value) if several else _word(value)


def _word(value: Any) -> str:
    """A value as it is written on the command line."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool):
        return str(in_yaml(value))
    if isinstance(value, str) and not re.fullmatch(r"[\w./+-]+", value):
        return "'" + value.replace("\\", "\\\\").replace("'", "\\'") + "'"
    if isinstance(value, Iterable) and not isinstance(value, str):
        return "[" + ",".join(_word(one) for one in value) + "]"
    return str(value)
