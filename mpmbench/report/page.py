"""The report of a campaign: figures and tables, and all of it on one page that opens offline."""

import base64
import re
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
import numpy as np
from matplotlib.figure import Figure

from mpmbench.analysis.convergence import INTERVAL_MEANING
from mpmbench.analysis.estimate import OrderEstimate
from mpmbench.report import atlas, coincide, figures, matrix, profiles, style, tables
from mpmbench.report.names import anchor, safe_name
from mpmbench.report.series import Study, further_studies, orders_of, studies
from mpmbench.report.tables import Table
from mpmbench.report.timing import clock_of, compared, timings
from mpmbench.results.netcdf import unverified
from mpmbench.results.one_move import in_one_move
from mpmbench.results.records import Campaign, read_campaign

ERRORS = ("error_displacement_rms", "error_stress_rms")
FORMATS: dict[str, dict[str, Any]] = {
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None}},
    "png": {"metadata": {"Software": None}},
}
MANIFEST = "files.txt"
SCREEN_SCALE = 1.55  # a figure is at most this much larger on the screen than in a journal


@dataclass(frozen=True)
class Picture:
    """A figure on the page: its file stem, its drawing and what the reader should know about it."""

    name: str
    title: str
    caption: str
    svg: markupsafe.Markup

    @property
    def wide(self) -> bool:
        """Whether it takes more than one column of a journal."""
        width = re.search(r"max-width:(\d+)px", self.svg)
        return width is not None and int(width.group(1)) > 1.2 * 72 * SCREEN_SCALE * style.COLUMN


@dataclass
class Section:
    """Figures and tables of one problem."""

    title: str
    study: Study
    writer: "Writer"
    lead: str = ""
    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def draw(self, name: str, title: str, caption: str, figure: Figure | None) -> None:
        """Add a figure, if there is one."""
        if figure is not None:
            stem = f"{safe_name(self.study.problem)}-{name}"
            self.pictures.append(self.writer.picture(stem, title, caption, figure))


def build(results: Path, output: Path | None = None) -> Path:
    """Write the report of a campaign and return its page.

    Parameters
    ----------
    results : Path
        Folder of result files.
    output : Path, optional
        Where the report goes; ``<results>/report`` by default.

    Returns
    -------
    Path
        ``index.html``; figures (SVG, PDF, PNG) and tables (CSV, Markdown, LaTeX) are in the folders
        beside it.

    Raises
    ------
    FileNotFoundError
        When there is no result file.
    """
    campaign = read_campaign(Path(results))
    if output is None:
        writer = Writer(campaign.folder / "report", within=campaign.folder)
    else:
        writer = Writer(Path(output))
    with style.applied():
        sections = [_section(study, writer) for study in studies(campaign)]
        for study in further_studies(campaign):
            section = next(one for one in sections if one.study.problem == study.problem)
            _further(section, study)
        if matrix.wanted(campaign):
            sections.insert(0, _overview(campaign, writer))
    for section in sections:
        for table in section.tables:
            writer.table(table)
    page = writer.text("index.html", _render(campaign, sections))
    writer.finish()
    return page


class Writer:
    """Writes the files of a report, each in one move, and removes those of an earlier one.

    Parameters
    ----------
    target : Path
        Folder of the report.
    within : Path, optional
        Folder that nothing may be written outside of, through links neither: by default `target`.
    """

    def __init__(self, target: Path, within: Path | None = None) -> None:
        self.target = target
        self.within = within or target
        self.written: list[str] = []

    def text(self, name: str, content: str) -> Path:
        """Write one text file."""
        return self.data(name, content.encode())

    def data(self, name: str, content: bytes) -> Path:
        """Write one file of bytes."""
        with self._place(name) as file:
            file.write_bytes(content)
        return self.target / name

    def table(self, table: Table) -> None:
        """Write a table as CSV, Markdown and LaTeX."""
        texts = {"csv": table.csv(), "md": table.markdown(), "tex": table.latex()}
        for suffix, content in texts.items():
            self.text(f"tables/{table.name}.{suffix}", content)

    def picture(self, name: str, title: str, caption: str, figure: Figure) -> Picture:
        """Save a figure as SVG, PDF and PNG, and return it for the page."""
        for suffix, options in FORMATS.items():
            with self._place(f"figures/{name}.{suffix}") as file:
                figure.savefig(file, format=suffix, **options)
            if suffix == "svg":  # laid out once; the other formats need not do it again
                figure.set_layout_engine("none")
        drawing = (self.target / "figures" / f"{name}.svg").read_text(encoding="utf-8")
        return Picture(name, title, caption, inline_svg(drawing, name))

    def finish(self) -> None:
        """Remove the files of the last report that this one no longer has."""
        manifest = self.target / MANIFEST
        before = manifest.read_text("utf-8", "replace").splitlines() if manifest.exists() else []
        for name in set(before) - set(self.written):
            place = self.target / name
            if self._holds(place) and place.is_file():
                place.unlink()
        self.text(MANIFEST, "\n".join(sorted(self.written)) + "\n")

    def _holds(self, place: Path) -> bool:
        """Whether a file would lie in the folder of the report, all links followed."""
        return place.resolve().is_relative_to(self.within.resolve())

    @contextmanager
    def _place(self, name: str) -> Iterator[Path]:
        if not self._holds(self.target / name):
            raise PermissionError(f"{self.target / name} lies outside of {self.within}")
        with in_one_move(self.target / name) as unfinished:
            yield unfinished
        self.written.append(name)


def inline_svg(drawing: str, name: str) -> markupsafe.Markup:
    """An SVG file of matplotlib as a part of a page: no XML head, fluid width, identifiers of its own.

    All text in it is outlines; what the comments say of them is left out.
    """
    name = safe_name(name)
    drawing = drawing[drawing.index("<svg") :]
    drawing = re.sub(r"<!--.*?-->\s*", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r'\bid="', f'id="{name}-', drawing)
    drawing = re.sub(r'href="#', f'href="#{name}-', drawing)
    drawing = drawing.replace("url(#", f"url(#{name}-")
    head, body = drawing.split(">", 1)
    width = re.search(r'viewBox="0 0 ([\d.]+) ', head)
    widest = f"max-width:{SCREEN_SCALE * float(width.group(1)):.0f}px" if width else ""
    head = re.sub(r' (width|height)="[^"]*"', "", head)
    return markupsafe.Markup(f'{head} style="width:100%;{widest}">{body}')


def template(name: str) -> jinja2.Template:
    """A page's template, which escapes all that it shows.

    Its filters: ``unbroken`` keeps ``2.8e-10`` on one line, ``anchor`` gives the identifier of a
    run, and ``base64`` the bytes of an image.
    """
    loader = jinja2.PackageLoader("mpmbench", package_path="")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"unbroken": _unbroken, "anchor": anchor}
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode()
    return environment.get_template(name)


def _unbroken(text: str) -> markupsafe.Markup:
    parts = re.split(r"(\d+(?:\.\d+)?e-\d+)", text)
    kept = [markupsafe.Markup('<span class="whole">{}</span>').format(part) for part in parts[1::2]]
    parts[1::2] = kept
    return markupsafe.Markup("").join(parts)


def _overview(campaign: Campaign, writer: Writer) -> Section:
    """All problems at once: who is best where, at equal cost."""
    fields = matrix.fields_of(campaign)
    entries = {field.problem: field.entries() for field in fields}
    first = studies(campaign)[0]
    section = Section("Everything against everything", first, writer)
    for name, title, caption, figure in (
        ("heat_map", "Error at equal cost", matrix.CAPTION, matrix.heat_map(entries)),
        ("profile", "Profile over the problems", matrix.PROFILE, matrix.profile(entries)),
    ):
        section.pictures.append(writer.picture(f"matrix-{name}", title, caption, figure))
    section.notes += [f"{field.problem}: {field.sentence()}" for field in fields]
    section.tables.append(matrix.table(fields, entries))
    return section


def _section(study: Study, writer: Writer) -> Section:
    """Figures and tables of one problem along its main axis."""
    section = Section(study.problem.replace("_", " "), study, writer)
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
    _add_fields(section, study)
    caption = "Every run by its status; a mark stands for a reason, and a place without colour for no run."
    section.draw("atlas", "Failure atlas", caption, atlas.atlas(study))

    found = [
        tables.orders(study, estimates),
        *(tables.errors(study, quantity) for quantity in ERRORS),
        *(timings(study), atlas.reasons(study), tables.failures(study), tables.all_runs(study)),
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


def _add_fields(section: Section, study: Study) -> None:
    value, fields = profiles.final_fields(study)
    if not fields:
        return
    place = f"{value:g} {study.axis.unit}" if np.isfinite(value) else "the only size"
    exact = any(one.exact is not None for one in fields)
    caption = f"Particles at the end of the run, {place}" + (
        "; black: exact solution." if exact else "."
    )
    ready = sum(len(one.ok) > 0 for one in study.series)
    if len(fields) < ready:
        caption += f" {len(fields)} of {ready} curves."
    if fields[0].position.shape[1] > 1:
        caption += " The row of particles nearest the middle."
    section.draw("stress_profile", "Final stress", caption, profiles.stress_profile(fields))
    caption = f"Particles where they are at the end, coloured by their stress, {place}."
    section.draw("particle_map", "Particle map", caption, profiles.particle_map(fields))
    if any("plastic_strain" in one.scalars for one in fields):
        for name, label in profiles.SCALARS.items():
            words = label.split(" [")[0]
            caption = f"Particles where they are at the end, coloured by their {words}, {place}."
            title = f"Map of the {words}"
            section.draw(f"map_{name}", title, caption, profiles.particle_map(fields, name))


def _code_versions(campaign: Campaign) -> int:
    """Most versions of the code behind runs of one kind: a kind's code are the files it uses."""
    if "code_hash" not in campaign.provenance:
        return 1
    keys = ("problem", "method", "basis", "material")
    kinds = [campaign.runs[key] for key in keys if key in campaign.runs]
    return int(campaign.provenance["code_hash"].groupby(kinds).nunique().max())


def facts(campaigns: Collection[Campaign]) -> dict[str, Any]:
    """What every page says of its runs: how they ended, and what made them."""
    status = [word for campaign in campaigns for word in campaign.runs.get("status", ())]
    origin: dict[str, set[str]] = {}
    for campaign in campaigns:
        for key, values in campaign.provenance.items():
            origin.setdefault(str(key), set()).update(map(str, values.dropna()))
    origin.pop("code_hash", None)
    return {
        "counts": dict(sorted(Counter(status).items())),
        "total": len(status),
        "unverified": unverified(file for one in campaigns for file in one.unverified),
        "unreadable": {file: why for one in campaigns for file, why in one.unreadable.items()},
        "provenance": {key: sorted(values) for key, values in sorted(origin.items())},
        "interval_meaning": INTERVAL_MEANING,
    }


def _render(campaign: Campaign, sections: list[Section]) -> str:
    return template("report/page.html.jinja").render(
        title=campaign.folder.resolve().name,
        sections=sections,
        code_versions=_code_versions(campaign),
        **facts([campaign]),
    )
