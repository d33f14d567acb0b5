"""Which clock a table of times goes by, and the table of solver times of a study."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from mpmbench.report.names import safe_name
from mpmbench.report.series import Series, Study
from mpmbench.report.tables import Cell, Table, median, ratio
from mpmbench.results.records import Campaign
from mpmbench.results.timings import is_busy

HOW = "`timing=exclusive` times each run alone, and the same command then adds the times only."


@dataclass(frozen=True)
class Clock:
    """What times are taken from.

    Attributes
    ----------
    quantity : str
        Scalar of a run: its wall-clock time, or its CPU time where other work disturbed the first.
    head : str
        What the head of a table says about load; empty on a quiet machine.
    note : str
        The same for its foot.
    """

    quantity: str
    head: str
    note: str

    def title(self, text: str) -> str:
        """The title of a table, which tells first of load."""
        return f"{text}, {self.head}" if self.head else text


def clock_of(runs: pd.DataFrame) -> Clock:
    """The clock for runs that are compared: CPU time where the machine was busy with other work."""
    runs = runs[runs.status == "ok"] if len(runs) else runs
    load = float(runs.load.mean()) if len(runs) else np.nan
    if not is_busy(load):
        known = "is unknown" if np.isnan(load) else f"was {load:.2f} processors"
        return Clock("solver_time", "", f"Wall-clock times; the load by other work {known}.")
    told = f"made under load: other work kept {load:.2f} processors busy"
    if "solver_cpu_time" in runs and np.isfinite(runs.solver_cpu_time).all():
        note = "Times and ratios are CPU times of all threads, since wall-clock times also count others."
        return Clock("solver_cpu_time", f"CPU time, {told}", note)
    return Clock(
        "solver_time", told, "Wall-clock times, which also count others: CPU times are unknown."
    )


def clock_in(campaigns: Mapping[str, Campaign], *names: str) -> Clock:
    """The clock for the runs of campaigns that one table shows, as far as they are there."""
    there = [campaigns[name].runs for name in names if name in campaigns]
    clock = clock_of(pd.concat(there) if there else pd.DataFrame())
    alone = all((runs.timing_context == "exclusive").all() for runs in there)
    return clock if alone else replace(clock, note=f"{clock.note} The runs were not timed alone.")


def compared(study: Study) -> tuple[pd.DataFrame, str]:
    """Finished runs whose times are compared, and their context: those timed alone, if there are any."""
    done = study.runs[study.runs.status == "ok"]
    alone = done[done.timing_context == "exclusive"]
    return (alone, "exclusive") if len(alone) else (done, "shared")


def timings(study: Study) -> Table:
    """Solver times of runs that had the machine to themselves, and ratios to linear MPM.

    Where no run had, those of runs that shared it are indicative.
    """
    chosen, context = compared(study)
    clock = clock_of(chosen)
    values = study.values()
    rows = []
    missing_base = False
    for one in study.series:
        base = _baseline(study, one)
        row: list[Any] = [one.name]
        for value in values:
            time = _time_at(one, value, clock, context)
            linear = _time_at(base, value, clock, context) if base is not None else Cell()
            over = ratio(time, linear)
            missing_base |= isinstance(time.value, float) and over.value == ""
            row += [time, over]
        if any(isinstance(cell.value, float) for cell in row[1:]):
            rows.append(row)
    columns = ["curve"]
    for value in values:
        columns += [f"{value:g} {study.axis.unit} [s]", "ratio"]
    note = f"Without compiling; ratio to MPM linear at the same size. {clock.note}"
    title = "Solver time"
    if context == "exclusive":
        note += " Medians over repeats."
        left_out = int((study.runs.status == "ok").sum()) - len(chosen)
        note += f" {left_out} runs that shared the machine are left out." if left_out else ""
    else:
        title += ", indicative only: the runs were not timed alone"
        note += f" {HOW}"
    note += " A ratio is missing where MPM linear has no such time." if missing_base else ""
    name = f"{safe_name(study.problem)}-timings"
    return Table(name, clock.title(title), columns, rows, note, range(1, len(columns)))


def _baseline(study: Study, one: Series) -> Series | None:
    """Linear MPM with the same variant, otherwise lumped, otherwise the first."""
    linear = [base for base in study.series if (base.method, base.basis) == ("mpm", "linear")]
    same = [base for base in linear if base.variant == one.variant]
    lumped = [base for base in linear if set(base.runs["mass"]) == {"lumped"}]
    return next(iter(same or lumped or linear), None)


def _time_at(one: Series, value: float, clock: Clock, context: str) -> Cell:
    runs = one.finite(clock.quantity)
    runs = runs[(runs.axis_value == value) & (runs.timing_context == context)]
    return median(runs, clock.quantity)
