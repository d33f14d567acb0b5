"""What a paper's report is made of: its campaigns of runs, and chapters of figures and tables."""

import dataclasses
import re
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mpmbench.report import coincide, figures, tables
from mpmbench.report.claims import STATED, Claim, SetUp
from mpmbench.report.evidence import MissingRuns, Runs, column_of
from mpmbench.report.series import Study, orders_of, studies
from mpmbench.report.tables import Cell, Table
from mpmbench.results import completion
from mpmbench.results.records import Campaign, read_campaign


class Campaigns(dict[str, Campaign]):
    """Campaigns by the name of their experiment; one that is not there raises `MissingRuns`."""

    def __missing__(self, name: str) -> Campaign:
        raise MissingRuns(f"there are no results of the experiment {name}")


@dataclass(frozen=True)
class Drawing:
    """A figure, or the bytes of a moving picture (an animated GIF), and what it shows."""

    name: str
    title: str
    caption: str
    content: Any


@dataclass
class Chapter:
    """One section of the report.

    Attributes
    ----------
    name : str
        Short; the names of its files begin with it.
    title : str
    statement : str
        What the paper says or shows there.
    drawings, animations : list of Drawing
    tables : list of Table
    notes : list of str
        Sentences between figures and tables.
    """

    name: str
    title: str
    statement: str = ""
    drawings: list[Drawing] = field(default_factory=list)
    animations: list[Drawing] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def draw(self, name: str, title: str, caption: str, figure: Figure) -> None:
        """Add a figure; its file is called ``<chapter>-<name>``."""
        self.drawings.append(Drawing(f"{self.name}-{name}", title, caption, figure))

    def animate(self, name: str, title: str, caption: str, gif: bytes) -> None:
        """Add a moving picture; its file is called ``<chapter>-<name>.gif``."""
        self.animations.append(Drawing(f"{self.name}-{name}", title, caption, gif))

    def tabulate(
        self,
        name: str,
        title: str,
        columns: list[str],
        rows: list[list[Any]],
        numeric: Collection[int] = (),
        note: str = "",
    ) -> None:
        """Add a table of these rows, unless there are none; its file is ``<chapter>-<name>``."""
        self.add(Table(name, title, columns, rows, note, numeric))

    def add(self, table: Table, **changes: Any) -> None:
        """Add a table, unless it is empty; its file is called ``<chapter>-<name>``."""
        table = dataclasses.replace(table, **changes)
        if table:
            self.tables.append(dataclasses.replace(table, name=f"{self.name}-{table.name}"))

    def convergence(
        self,
        campaign: Campaign,
        quantities: Iterable[str] = ("error_displacement_rms",),
        problem: str | None = None,
        prefix: str = "",
        where: str = "",
    ) -> None:
        """Add the errors along the main axis of a campaign as figure and table, and its orders.

        Parameters
        ----------
        campaign : Campaign
        quantities : iterable of str
            Scalars of the runs, for example ``error_stress_rms``.
        problem : str, optional
            Needed when the campaign has runs of several problems.
        prefix : str
            Begins the names, when a chapter has several of these.
        where : str
            Ends the titles then, for example ``"plate"``.
        """
        study = study_of(campaign, problem)
        more = f", {where}" if where else ""
        estimates = {quantity: orders_of(study, quantity) for quantity in quantities}
        for quantity, orders in estimates.items():
            figure = figures.convergence(study, quantity, orders)
            if figure is None:
                continue
            what = quantity.removeprefix("error_").removesuffix("_rms")
            words = re.sub(r"_l[12]_max$", "", what).replace("_", " ")
            caption = coincide.caption(study, quantity, figure)
            self.draw(f"{prefix}{what}", f"{words.capitalize()} error{more}", caption, figure)
            table = tables.errors(study, quantity)
            self.add(table, name=f"{prefix}{what}", title=table.title + more)
        more_differs = coincide.differing(study)
        if more_differs and more_differs not in self.notes:
            self.notes.append(more_differs)
        table = tables.orders(study, estimates)
        self.add(table, name=f"{prefix}orders", title=table.title + more)


@dataclass(frozen=True)
class Paper:
    """A paper that is reproduced.

    Attributes
    ----------
    name : str
        Name of its folders of experiments, results and reports.
    title, reference : str
    chapters : tuple of callable
        Each takes `Campaigns` and returns a `Chapter`.
    claims : tuple of Claim
    summary : str
        A paragraph on top of the page.
    set_ups : tuple of SetUp
        What the claims are judged in: first the one that the paper states, then those one choice
        away.
    stated : str
        The stated set-up in words.
    """

    name: str
    title: str
    reference: str
    chapters: tuple[Callable[[Campaigns], Chapter], ...]
    claims: tuple[Claim, ...] = ()
    summary: str = ""
    set_ups: tuple[SetUp, ...] = (STATED,)
    stated: str = ""


def read_campaigns(folder: Path) -> Campaigns:
    """Read all folders with results below a folder; the runs are called ``<experiment>/<file>``."""
    found = Campaigns()
    for place in sorted(
        {file.parent for file in Path(folder).rglob("*.nc") if not file.name.startswith(".")}
    ):
        name = place.relative_to(folder).as_posix()
        found[name] = _below(_complete(read_campaign(place)), name, Path(folder))
    return found


def _complete(campaign: Campaign) -> Campaign:
    """A campaign without files that its experiment no longer has, where that is known."""
    listed = completion.read(campaign.folder).get("files")
    if listed is None:
        return campaign
    keep = campaign.runs.index.isin(list(listed))
    unreadable = {file: reason for file, reason in campaign.unreadable.items() if file in listed}
    return dataclasses.replace(campaign, unreadable=unreadable).only(keep)


def _below(campaign: Campaign, name: str, folder: Path) -> Campaign:
    """The same campaign, its files named from the folder above."""
    unreadable = {f"{name}/{file}": reason for file, reason in campaign.unreadable.items()}
    named = campaign.each(lambda table: table.rename(index=lambda file: f"{name}/{file}"))
    return dataclasses.replace(named, folder=folder, unreadable=unreadable)


def study_of(campaign: Campaign, problem: str | None = None) -> Study:
    """The runs of one problem along their main axis.

    Raises
    ------
    MissingRuns
        When the campaign has no runs of this problem.
    """
    found = [study for study in studies(campaign) if problem in (None, study.problem)]
    if not found:
        raise MissingRuns(
            f"{campaign.folder.name}: there are no runs of {problem or 'any problem'}"
        )
    return found[0]


def subset(campaign: Campaign, **match: Any) -> Campaign:
    """The runs of a campaign that match, as in `Runs.number`; lists of values are alternatives.

    Raises
    ------
    MissingRuns
        When none does.
    """
    keep = campaign.runs.index == campaign.runs.index
    for key, value in match.items():
        column = column_of(campaign, campaign.folder.name, key)
        keep &= column.isin(value if isinstance(value, (list, tuple, set)) else [value]).to_numpy()
    if not keep.any():
        raise MissingRuns(f"{campaign.folder.name}: no run matches {match}")
    return campaign.only(keep)


def variables(
    campaigns: Campaigns, campaign: str, *wanted: str, **match: Any
) -> tuple[str, dict[str, np.ndarray]]:
    """File of the one finished run that matches, and its variables.

    Raises
    ------
    MissingRuns
        When there is no such run, or it did not finish.
    """
    file = number(campaigns, campaign, "steps", **match).files[0]
    return file, campaigns[campaign].variables(file, wanted)


def number(campaigns: Campaigns, campaign: str, quantity: str, **match: Any) -> Cell:
    """As `Runs.number`, with the files of the run."""
    runs = Runs(campaigns)
    return Cell(runs.number(campaign, quantity, **match), runs.evidence[-1].files)


def cell(campaigns: Campaigns, campaign: str, quantity: str, **match: Any) -> Cell:
    """The number of the one run that matches, or how it failed, with its file; empty without a run or a number."""
    with suppress(MissingRuns):
        return number(campaigns, campaign, quantity, **match)
    with suppress(MissingRuns):
        runs = Runs(campaigns)
        status = runs.status(campaign, **match).replace("_", " ")
        return Cell("" if status == "ok" else status, runs.evidence[-1].files)
    return Cell()
