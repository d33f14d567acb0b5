"""What a child process does: check configurations, run one case and leave its file."""

import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numpy as np

from mpmbench import case
from mpmbench.case import Outcome
from mpmbench.case.output import scalar
from mpmbench.core.end_state import EndState, from_numbers
from mpmbench.core.errors import BadSetting, NotApplicable
from mpmbench.core.registry import BrokenPlugin
from mpmbench.results import netcdf
from mpmbench.results.layout import STATUSES
from mpmbench.results.provenance import library_versions
from mpmbench.results.timings import SAID, UNITS
from mpmbench.runs.process.exclusive import undisturbed_since
from mpmbench.runs.process.load import load_between, reading
from mpmbench.runs.process.messages import Line
from mpmbench.runs.process.reasons import explain

REPORT_EVERY = 0.02  # seconds between two progress messages
CLOCKS = ("solver_time", "solver_cpu_time")


def serve(line: Line) -> None:
    """Answer requests ``(name, *arguments)`` until the client hangs up."""
    answers = ANSWERS | {"run": partial(run, line), "check": partial(check, line)}
    while True:
        try:
            name, *arguments = line.receive() or [""]
        except (EOFError, OSError):
            return
        try:
            line.send(("done", answers[name](*arguments)))
        except BaseException as error:  # whatever it is, it has a name
            line.send(("failed", explain(error)))
            raise


def check(line: Line, cells: list[tuple[dict[str, Any], str, str]]) -> None:
    """Tell of each configuration what is wrong with it, its memory, and its earlier result."""
    for config, reason, target in cells:
        answer: dict[str, Any] = {"bad": "", "not_applicable": reason, "memory": 0.0}
        try:
            if not reason:
                answer["memory"] = case.estimate_memory(config)
        except BadSetting as error:
            answer["bad"] = str(error)
        except NotApplicable as error:
            answer["not_applicable"] = str(error)
        except BrokenPlugin as error:
            answer["bad"] = explain(error)
        except BaseException as error:  # sys.exit too
            name = Path(target).stem
            answer["bad"] = f"{name}: the check of this configuration failed: {explain(error)}"
        answer["earlier"], answer["damage"] = netcdf.look(Path(target))
        line.send(("part", answer))


def run(
    line: Line,
    config: dict[str, Any],
    attributes: dict[str, Any],
    target: str,
    began: float,
    earlier: dict[str, list[float]],
    shorter: str = "",
) -> dict[str, Any]:
    """Run one case and write its file; returns status, reason and scalars.

    A run that has the machine to itself, since its turn `began`, keeps the timings of all its
    repeats, those of `earlier` ones first; their medians are the solver's times. It goes on from the
    end of the `shorter` run in this file, if there is one.
    """
    started, before = time.perf_counter(), reading()
    forget_peak_memory()
    outcome = solve(config, progress_to(line), shorter)
    seconds, load = time.perf_counter() - started, load_between(before, reading())
    memory = scalar(peak_memory(), "MiB", "peak resident memory of the process")
    outcome.variables |= {
        "wall_time": scalar(seconds, "s", "wall-clock time of the run"),
        "peak_memory": memory,
    }
    timings = {name: [value] for name, value in load.items()}
    if outcome.attrs["status"] == "ok" and attributes["timing_context"] == "exclusive":
        if undisturbed_since(began):
            now = {f"{clock}s": float(outcome.variables[clock][1]) for clock in CLOCKS} | load
            earlier = {name: [*earlier.get(name, []), now[name]] for name in UNITS}
        outcome.attrs["timing_context"] = "exclusive" if earlier else "shared"
        if earlier:
            timings = earlier
            for clock in CLOCKS:
                dims, _, labels = outcome.variables[clock]
                outcome.variables[clock] = dims, np.median(timings[f"{clock}s"]), labels
    outcome.attrs |= timings | {"timings": SAID}
    return finish(outcome, attributes, target)


def end_of(target: str) -> EndState:
    """The end of the run in a file, to go on from; raises `NotApplicable` when there is none."""
    try:
        found = netcdf.read_end_state(Path(target))
    except netcdf.Damaged as damaged:
        raise NotApplicable(damaged.reason) from None
    if found is None:
        why = "time steps that were not constant, or a file of an older version"
        raise NotApplicable(f"its file holds no state at the end: {why}")
    return from_numbers(*found)


def continuing(config: dict[str, Any], target: str) -> str:
    """Why a run cannot go on from the end of the one in a file; empty when it can."""
    try:
        case.refuse_to_continue(config, end_of(target))
    except NotApplicable as error:
        return str(error)
    return ""


def read(target: str) -> tuple[dict[str, Any], dict[str, tuple[float, str]]] | None:
    """Attributes and scalars, with their units, of a result; None when there is none."""
    try:
        attributes, scalars = netcdf.read_scalars(Path(target))
    except netcdf.Damaged:
        return None
    return attributes, {
        name: (value, said.get("units", "")) for name, (value, said) in scalars.items()
    }


def record(
    attributes: dict[str, Any], known: dict[str, tuple[float, str, str]], target: str
) -> dict[str, Any]:
    """Write the file of a run that did not; `known` has value, units and long name of scalars."""
    scalars = {name: scalar(*said) for name, said in known.items()}
    return finish(Outcome(scalars, {}), attributes, target)


def solve_only(config: dict[str, Any]) -> dict[str, Any]:
    """Run one case and keep nothing; for filling the cache of compiled kernels."""
    outcome = solve(config, None)
    return {"status": outcome.attrs["status"], "reason": outcome.attrs.get("reason", "")}


def solve(config: dict[str, Any], progress: Any, shorter: str = "") -> Outcome:
    """What came of the case; whatever it raises becomes a status and a reason."""
    try:
        numba.set_num_threads(config["threads"])
        return case.run(config, progress, end_of(shorter) if shorter else None)
    except MemoryError:
        return Outcome({}, {"status": "out_of_memory", "reason": "an allocation was refused"})
    except NotApplicable as error:
        return Outcome({}, {"status": "not_applicable", "reason": str(error)})
    except BaseException as error:  # sys.exit too
        text = "".join(traceback.format_exception(error)).encode("utf-8", "replace").decode()
        return Outcome({}, {"status": "crashed", "reason": explain(error), "traceback": text})


def finish(outcome: Outcome, attributes: dict[str, Any], target: str) -> dict[str, Any]:
    """Add the attributes that the case did not set, write the file and summarise it."""
    own = {key: value for key, value in outcome.attrs.items() if value is not None}
    if own.get("status", "ok") not in STATUSES:  # a plug-in's own
        own |= {"status": "crashed", "reason": f"{own['status']}: {own.get('reason', '')}"}
    outcome.attrs = {"reason": "", **attributes, **library_versions(), **own}
    unwritten = ""
    try:
        scalars = {
            name: (float(value), str(labels.get("units", "")))
            for name, (_, value, labels) in outcome.variables.items()
            if np.ndim(value) == 0
        }
        netcdf.write(outcome.variables, outcome.attrs, Path(target))
    except OSError as error:
        unwritten = f"the result could not be written to {target}: {error.strerror or error}"
    except (ValueError, TypeError) as error:  # a plug-in's variable is none that a file can hold
        if not outcome.variables:
            raise
        failed = {"status": "crashed", "reason": f"its result fits into no file: {explain(error)}"}
        return finish(Outcome({}, failed), attributes, target)
    return {
        "status": outcome.attrs["status"],
        "reason": outcome.attrs["reason"],
        "scalars": scalars,
        "unwritten": unwritten,
        "timings": {name: outcome.attrs[name] for name in UNITS if "solver_times" in outcome.attrs},
        "has_traceback": "traceback" in outcome.attrs,
    }


def score(name: str, *arguments: Any) -> Any:
    """The answer of a function of `scoring`, imported on use; what it raises becomes a sentence."""
    try:
        from mpmbench.runs.process import scoring

        return getattr(scoring, name)(*arguments)
    except BaseException as error:
        return explain(error)


ANSWERS: dict[str, Callable[..., Any]] = {
    "read": read,
    "record": record,
    "solve": solve_only,
    "continuing": continuing,
    **{name: partial(score, name) for name in ("contents", "outline", "judge", "compile_time")},
}


def progress_to(line: Line) -> Any:
    """A progress function that sends a message every `REPORT_EVERY` seconds."""
    last = -1.0

    def progress(fraction: float, simulation_time: float) -> None:
        nonlocal last
        now = time.perf_counter()
        if last < 0 or now - last > REPORT_EVERY:
            last = now
            line.send(("progress", float(fraction), float(simulation_time)))

    return progress


def forget_peak_memory() -> None:
    """Start a new measurement of the peak memory of this process (Linux)."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_memory() -> float:
    """Peak resident memory [MiB] since `forget_peak_memory`; elsewhere than on Linux, ever."""
    try:
        status = Path("/proc/self/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024
    except (OSError, IndexError):
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
