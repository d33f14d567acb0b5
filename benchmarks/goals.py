"""What the program is to reach, and what was measured beside it: one table at the end of ``python -m benchmarks``."""

import json
from dataclasses import dataclass
from pathlib import Path

from mpmbench.results.provenance import processor


@dataclass(frozen=True)
class Goal:
    """A figure that a section measures."""

    limit: float
    unit: str
    least: bool = False  # whether the figure has to be at least the limit, or at most


TIMES, MICROSECONDS, MILLISECONDS, SECONDS = "times", "us", "ms", "s"
GOALS = {
    "explicit over the best peer, 2D linear": Goal(1.5, TIMES, least=True),
    "explicit over the best peer, 2D quadratic": Goal(1.5, TIMES, least=True),
    "explicit over the best peer, 3D linear": Goal(1.5, TIMES, least=True),
    "explicit over the best peer, 3D quadratic": Goal(1.5, TIMES, least=True),
    "user's step over the bare one, linear": Goal(1.1, TIMES),
    "user's step over the bare one, quadratic": Goal(1.1, TIMES),
    "the same with the plate's body force, linear": Goal(1.3, TIMES),
    "the same with the plate's body force, quadratic": Goal(1.3, TIMES),
    "two threads over one, the slowest explicit step": Goal(1.8, TIMES, least=True),
    "two threads over one, the fastest explicit step": Goal(1.8, TIMES, least=True),
    "two threads over one, implicit functions and assembly": Goal(1.8, TIMES, least=True),
    "max-ent in quadratic B-splines": Goal(12.0, TIMES),
    "LME in quadratic B-splines": Goal(20.0, TIMES),
    "MLS in quadratic B-splines": Goal(20.0, TIMES),
    "GIMP in quadratic B-splines": Goal(1.3, TIMES),
    "CPDI in quadratic B-splines": Goal(3.0, TIMES),
    "CPDI2 in quadratic B-splines": Goal(3.5, TIMES),
    "DDMP in quadratic B-splines": Goal(2.0, TIMES),
    "LME in 3D, a particle": Goal(1.5, MICROSECONDS),
    "consistent over lumped step, linear": Goal(2.0, TIMES),
    "consistent over lumped step, quadratic": Goal(3.0, TIMES),
    "apic over flip, step, quadratic": Goal(1.4, TIMES),
    "TLS over splines, step": Goal(3.0, TIMES),
    "Taylor's rod by OTM, a particle and step": Goal(1.5, MICROSECONDS),
    "Taylor's rod by 3D B-spline MPM, a particle and step": Goal(0.12, MICROSECONDS),
    "search for contact in a step, OTM on six cubes": Goal(15.0, "%"),
    "growth of the search for contact with the surface, exponent": Goal(1.1, "-"),
    "six cubes, 18,000 steps": Goal(20.0, SECONDS),
    "Newton iteration, implicit MPM": Goal(1.5, MILLISECONDS),
    "Newton iteration, GMM": Goal(2.5, MILLISECONDS),
    "implicit functions, LME": Goal(4.0, MILLISECONDS),
    "implicit functions, MLS": Goal(4.0, MILLISECONDS),
    "soil column, h = 0.1 m, implicit MPM": Goal(4.0, SECONDS),
    "soil column, h = 0.1 m, GMM-LME": Goal(8.0, SECONDS),
    "1D bar, a particle and step": Goal(8.0, "ns"),
    "growth of cost with particles, exponent": Goal(1.02, "-"),
    "memory in 2D, a particle": Goal(400.0, "byte"),
    "first run of all": Goal(5.0, SECONDS),
    "second run": Goal(0.6, SECONDS),
    "cell of a sweep besides solving": Goal(20.0, MILLISECONDS),
}
_measured: dict[str, float] = {}


def measured(row: str, value: float) -> None:
    """Keep a figure for the table; `row` is one of `GOALS`."""
    assert row in GOALS, row
    _measured[row] = float(value)


def print_goals(before: dict[str, float] | None = None) -> None:
    """The goals beside what was measured in this run, and beside an earlier run where one is given."""
    if not _measured:
        return
    ratio = "  over before" if before else ""
    print(f"\nGoals and figures of this run on {processor()}")
    print(f"{'row':56} {'goal':>14} {'figure':>9} {'unit':6} {'met':3}{ratio}")
    for row, goal in GOALS.items():
        if row not in _measured:
            continue
        value = _measured[row]
        met = "yes" if (value >= goal.limit if goal.least else value <= goal.limit) else "no"
        limit = f"{'at least' if goal.least else 'at most'} {goal.limit:g}"
        change = f" {value / before[row]:12.2f}" if before and before.get(row) else ""
        print(f"{row:56} {limit:>14} {value:9.3g} {goal.unit:6} {met:3}{change}")


def store(file: Path) -> None:
    """Write the figures of this run as JSON, with their units and the processor."""
    figures = {row: {"value": value, "unit": GOALS[row].unit} for row, value in _measured.items()}
    file.write_text(json.dumps({"processor": processor(), "figures": figures}, indent=1) + "\n")


def stored(file: Path) -> dict[str, float]:
    """The figures that `store` has written."""
    figures = json.loads(file.read_text())["figures"]
    return {row: figure["value"] for row, figure in figures.items()}
