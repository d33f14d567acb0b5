"""Simulations of things that were made in Python, for scripts that know no file."""

import os
import time
from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from mpmbench.runs.process import environment

environment.prepare(os.environ)  # where kernels are kept, before anything of theirs is imported

from mpmbench.case.output import measured  # noqa: E402
from mpmbench.case.read import instantiate, plugin  # noqa: E402
from mpmbench.core import simulation as solver  # noqa: E402
from mpmbench.core.loops import find_loop  # noqa: E402
from mpmbench.report.notebook import Result  # noqa: E402
from mpmbench.settings.schema import BadInput, composed, did_you_mean, options  # noqa: E402


def make(kind: str, name: str, **settings: Any) -> Any:
    """A method, basis or material by its name, with its settings.

    Parameters
    ----------
    kind : {"method", "basis", "material"}
    name : str
        As on the command line, those of plug-ins among them.
    **settings
        Keys of this option, for example ``degree=3``.

    Raises
    ------
    BadInput
        When there is no such option.
    BadSetting
        When a setting is wrong.
    """
    if kind not in ("method", "basis", "material"):
        raise BadInput(f"make: {kind} is none of method, basis, material")
    if name not in options(kind):
        hint = did_you_mean(name, options(kind)) or f"; there are {', '.join(options(kind))}"
        raise BadInput(f"{kind}={name}: there is no {kind} {name}{hint}")
    given = composed(kind, name)[kind] | settings
    if kind == "method":
        return instantiate(kind, find_loop(given["time"]), given)
    return plugin(kind, given | {"name": name})


def simulate(
    body: solver.Body,
    basis: Any,
    material: Any,
    method: Any = "mpm",
    *,
    time_step: float,
    end_time: float,
    snapshot_times: Iterable[float] = (),
) -> Result:
    """Simulate a body that was made in Python, in this process and without any file.

    Parameters
    ----------
    body : Body
        Nodes, particles, constraints and loads; it is not changed.
    basis, material, method : str or object
        Names, or what `make` gives for them, or dataclasses of one's own.
    time_step, end_time : float
        [s]
    snapshot_times : iterable of float
        Instants [s] besides the start and the end at which fields are kept.

    Returns
    -------
    Result
        As that of `run`, without what only a problem knows: exact solutions and errors.

    Raises
    ------
    NotApplicable
        When the combination makes no sense.
    """
    basis, material, method = (
        make(kind, chosen) if isinstance(chosen, str) else chosen
        for kind, chosen in (("basis", basis), ("material", material), ("method", method))
    )
    name = type(basis).__name__
    method.check(SimpleNamespace(basis=basis, basis_name=name, material=material))
    basis.check(method, False)
    started = time.perf_counter()
    first, second = (
        solver.build_state(
            replace(body, particles=deepcopy(body.particles)), basis, material, method
        )
        for _ in range(2)
    )
    # The first step compiles, so that the times of the second are without it.
    solver.simulate(first, time_step, min(time_step, end_time))
    compile_time = time.perf_counter() - started
    solution = solver.simulate(second, time_step, end_time, tuple(snapshot_times))
    return Result.of(measured(second, solution, compile_time).as_dataset())
