"""The sections of a campaign's page: figures and tables of each problem, and of all problems at once."""

from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure

from mpmbench.analysis.estimate import OrderEstimate
from mpmbench.report import atlas, coincide, figures, front, matrix, profiles, quantities, tables
from mpmbench.report.findings import findings
from mpmbench.report.histories import Histories
from mpmbench.report.names import safe_name
from mpmbench.report.series import Study, further_studies, orders_of, studies
from mpmbench.report.tables import Table
from mpmbench.report.timing import clock_of, compared, timings
from mpmbench.report.writer import Picture, Writer
from mpmbench.results.records import Campaign

ERRORS = ("error_displacement_rms", "error_stress_rms")
LARGEST = 1_500_000  # signs of all drawings of a page, which is to stay below 2 MB with its tables
# Drawings that a page with too many of them does without.
LEAST_TELLING = ("map_pressure", "map_von_mises", "map_", "stress_profile", "histories", "atlas")


@dataclass
class Section:
    """Figures and tables of one problem.

    Attributes
    ----------
    found : list of str
        What the page says of it at its top.
    lead : str
        In what its curves differ besides what is swept.
    """

    title: str
    study: Study
    writer: Writer
    found: list[str] = field(default_factory=list)
    lead: str = ""
    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)

    def draw(
        self, name: str, title: str, caption: str, figure: Figure | None, data: str = ""
    ) -> None:
        """Add a figure, if there is one; `data` is the table with its numbers."""
        if figure is not None:
            stem = f"{safe_name(self.study.problem)}-{name}"
            self.pictures.append(self.writer.picture(stem, title, caption, figure, data))


def sections_of(campaign: Campaign, writer: Writer) -> list[Section]:
    """All problems at once, where there are enough of them, and then each problem."""
    found = [_section(study, writer) for study in studies(campaign)]
    for study in further_studies(campaign):
        _further(next(one for one in found if one.study.problem == study.problem), study)
    return [_overview(campaign, writer), *found] if matrix.wanted(campaign) else found


def fitted(sections: list[Section], most: int = LARGEST) -> list[Section]:
    """The sections without the drawings for which a page has no room: the least telling go first.

    They stay as files, which the page links.
    """
    drawings = [(one, k) for one in sections for k in range(len(one.pictures))]
    drawings.sort(key=lambda place: _weight(place[0].pictures[place[1]]))
    room = most - sum(len(one.pictures[k].svg) for one, k in drawings)
    for section, k in drawings:
        if room >= 0:
            break
        room += len(section.pictures[k].svg)
        section.pictures[k] = section.pictures[k].left_out
    return sections


def _weight(picture: Picture) -> tuple[int, int]:
    """How much a page would lose with a drawing; of two that tell as much the larger one goes first."""
    kinds = [k for k, kind in enumerate(LEAST_TELLING) if f"-{kind}" in picture.name]
    return kinds[0] if kinds else len(LEAST_TELLING), -len(picture.svg)


def _overview(campaign: Campaign, writer: Writer) -> Section:
    """All problems at once: who is best where, at equal cost."""
    fields = front.fields_of(campaign)
    entries = {field.problem: field.entries() for field in fields}
    section = Section("Everything against everything", studies(campaign)[0], writer)
    for name, title, caption, figure in (
        ("heat_map", "Error at equal cost", matrix.CAPTION, matrix.heat_map(entries)),
        ("profile", "Profile over the problems", matrix.PROFILE, matrix.profile(entries)),
    ):
        section.pictures.append(writer.picture(f"matrix-{name}", title, caption, figure))
    section.tables.append(matrix.table(fields, entries))
    return section


def _section(study: Study, writer: Writer) -> Section:
    """Figures and tables of one problem along its main axis."""
    section = Section(study.problem.replace("_", " "), study, writer, findings(study))
    section.lead = coincide.differing(study)
    estimates = {quantity: orders_of(study, quantity) for quantity in ERRORS}
    for quantity, orders in estimates.items():
        _add_convergence(section, study, quantity, orders)
    clock = clock_of(compared(study)[0])
    drawn = figures.work_precision(study, ERRORS[0], clock.quantity)
    if drawn is not None:
        figure, exclusive = drawn
        caption = f"Error against the time of the solver, compiling excluded. {clock.note}"
        if not exclusive:
            caption += " These runs shared the machine with others: the times are only indicative."
        section.draw("work_precision", "Work and precision", caption, figure)
    caption = f"What the problem asks for, against {study.axis.label}."
    section.draw("quantities", "Quantities of interest", caption, quantities.panels(study))
    _add_histories(section, study)
    _add_fields(section, study)
    caption = "Every run by its status; a mark stands for a reason, and a place without colour for no run."
    section.draw("atlas", "Failure atlas", caption, atlas.atlas(study))

    found = [
        tables.orders(study, estimates),
        *(tables.errors(study, quantity) for quantity in ERRORS),
        *(quantities.table(study), timings(study)),
        *(atlas.reasons(study), tables.failures(study), tables.all_runs(study)),
    ]
    section.tables += filter(None, found)
    return section


def _further(section: Section, study: Study) -> None:
    """Errors along another swept key."""
    for quantity in ERRORS:
        _add_convergence(section, study, quantity, orders_of(study, quantity))
        table = tables.errors(study, quantity)
        if table:
            section.tables.insert(-1, table)


def _add_convergence(
    section: Section, study: Study, quantity: str, orders: dict[str, OrderEstimate]
) -> None:
    what = quantity.removeprefix("error_").removesuffix("_rms")
    axis = study.axis.key.split(".")[-1]
    other = axis != "resolution"
    title = f"{what.capitalize()} error" + (f" against {axis.replace('_', ' ')}" if other else "")
    figure = figures.convergence(study, quantity, orders)
    caption = coincide.caption(study, quantity, figure) if figure is not None else ""
    stem = f"convergence_{what}" + (f"-{safe_name(axis)}" if other else "")
    section.draw(stem, title, caption, figure)


def _add_histories(section: Section, study: Study) -> None:
    histories = Histories(study)
    figure = histories.panels()
    if figure is None:
        return
    table = histories.table()
    section.writer.text(f"tables/{table.name}.csv", table.csv())
    caption = (
        f"Over time, {_place(study, histories.value)}{_of_curves(study, len(histories.found))}."
    )
    section.draw("histories", "Histories", caption, figure, f"tables/{table.name}.csv")


def _place(study: Study, value: float) -> str:
    return f"{value:g} {study.axis.unit}" if np.isfinite(value) else "the only size"


def _of_curves(study: Study, shown: int) -> str:
    """How many of the curves that have a result are shown, if not all."""
    ready = sum(len(one.ok) > 0 for one in study.series)
    return f"; {shown} of {ready} curves" if shown < ready else ""


def _add_fields(section: Section, study: Study) -> None:
    value, fields = profiles.final_fields(study)
    if not fields:
        return
    place = _place(study, value) + _of_curves(study, len(fields))
    exact = any(one.exact is not None for one in fields)
    caption = (
        f"Particles at the end of the run, {place}{'; black: exact solution' if exact else ''}."
    )
    if fields[0].position.shape[1] > 1:
        caption += " The row of particles nearest the middle."
    section.draw("stress_profile", "Final stress", caption, profiles.stress_profile(fields))
    for name, label in profiles.MAPS.items():
        words = label.split(" [")[0]
        caption = f"Particles where they are at the end, coloured by their {words}, {place}."
        if name != "stress":
            caption += " The outermost hundredth of the values at either end shares a colour."
        figure = profiles.particle_map(fields, name)
        section.draw(f"map_{name}", f"Map of the {words}", caption, figure)
