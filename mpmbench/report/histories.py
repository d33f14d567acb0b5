"""Histories of runs: a problem's own time series and the energies, in panels and as a table."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from mpmbench.report.figures import in_units
from mpmbench.report.levels import finest_runs
from mpmbench.report.names import safe_name
from mpmbench.report.panels import Panel, drawn_panels
from mpmbench.report.series import Study
from mpmbench.report.tables import Cell, Table
from mpmbench.results.netcdf import History
from mpmbench.results.quantities import ENERGIES, of_interest

MOST_PANELS = 8


class Histories:
    """The histories of one run of each curve, at the finest value that most curves share.

    Parameters
    ----------
    study : Study
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.value, runs = finest_runs(study)
        self.files: dict[int, str] = {}
        self.found: dict[int, dict[str, History]] = {}
        for one, file in runs:
            number = next(k for k, other in enumerate(study.series) if other is one)
            found = study.campaign.histories(file)
            if "time" in found:
                self.files[number], self.found[number] = file, found

    @property
    def names(self) -> list[str]:
        """Own series first, then energies; those that are zero in all runs are left out."""
        known = dict.fromkeys(name for one in self.found.values() for name in one)
        known.pop("time", None)
        ordered = [*of_interest(known), *(name for name in ENERGIES if name in known)]
        return [
            name for name in ordered if any(_tells(one.get(name)) for one in self.found.values())
        ]

    def label(self, name: str) -> str:
        """``run out [m]``."""
        unit = next(one[name].unit for one in self.found.values() if name in one)
        return in_units(name.replace("_", " "), unit)

    def panels(self) -> Figure | None:
        """Every series over time, a panel for each."""
        found = [
            Panel(
                self.label(name),
                {
                    number: (one["time"].values, one[name].values)
                    for number, one in self.found.items()
                    if name in one
                },
            )
            for name in self.names[:MOST_PANELS]
        ]
        return drawn_panels(self.study, found, "time [s]", along_axis=False)

    def table(self) -> Table:
        """All series of the same runs, a row for each instant of each curve."""
        names = self.names
        columns = ["curve", "time [s]", *map(self.label, names)]
        stem = f"{safe_name(self.study.problem)}-histories"
        return Table(stem, "Histories", columns, list(self._rows(names)))

    def _rows(self, names: list[str]) -> Iterator[list[object]]:
        for number, one in self.found.items():
            curve = Cell(self.study.series[number].name, (self.files[number],))
            instants = len(one["time"].values)
            missing = np.full(instants, np.nan)
            parts = [one[name].values if name in one else missing for name in names]
            for k in range(instants):
                yield [curve, *(float(part[k]) for part in (one["time"].values, *parts))]


def _tells(history: History | None) -> bool:
    """Whether a series is anything but zero."""
    if history is None:
        return False
    return bool(np.any(np.abs(history.values[np.isfinite(history.values)]) > 0.0))
