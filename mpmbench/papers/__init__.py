"""Reports on papers: what a paper printed, what the runs say, and a verdict on each of its claims.

A paper is one folder, here or in ``papers/`` of a folder of plug-ins (`MPMBENCH_PLUGINS`)::

    papers/bar_orders/paper.py             PAPER = Paper(...); or __init__.py
    papers/bar_orders/experiments/bar.yaml experiments=bar_orders/bar; results/bar_orders/bar
    papers/bar_orders/plugins/             options and code that its experiments bring along

``mpmbench/samples/paper`` is a whole one. The experiments may stand in ``experiments/bar_orders``
beside ``papers`` as well, with their ``plugins``. The file has one object::

    claim = Claims()

    @claim(
        "OTM converges with order 2",
        "Fig. 3",
        quote="The convergence of the method is quadratic.",
        threshold="p is at least 1.7",
        holds=lambda p: p >= 1.7,
        sentence="p = {p:.2f}",
    )
    def order(runs: Runs) -> dict[str, float]:
        return {"p": runs.order("bar", ERROR, method="otm").slope}

    PAPER = Paper(
        name="bar_orders",
        title="Optimal transportation meshfree approximation schemes",
        reference="Li, Habbal and Ortiz, Int. J. Numer. Meth. Engng 83 (2010) 1541-1579",
        chapters=(bar_chapter, ...),
        claims=tuple(claim),
    )

A chapter is a function of the campaigns, by the names of their experiments, and returns a
`Chapter`::

    def bar_chapter(campaigns: Campaigns) -> Chapter:
        page = Chapter("bar", "Fig. 3: bar", statement="The paper: OTM converges with order 2.")
        page.convergence(campaigns["bar"])  # figures, orders and errors of a sweep
        page.draw("profile", "Stress", "Caption.", figure)  # any matplotlib figure
        page.animate("collapse", "Collapse", "Caption.", gif)  # bytes of an animated GIF
        page.tabulate("ends", "At the end", columns, rows)  # rows of values and cells
        page.notes.append("A sentence.")
        return page

Runs that are missing raise `MissingRuns` (a `Campaigns` does so by itself): the page then says so
in the place of that chapter. Cells of tables (`mpmbench.report.tables.Cell`) name their result
files: `kit.cell(campaigns, "bar", "error_displacement_rms", method="otm")` gives the number of the
one run that matches, with its file, or its status when it did not finish. In a `Campaign` of a
paper the index of the runs is ``<experiment>/<file>``, so that names are unique on the page.

`build` writes ``reports/<name>/``: README.md, figures/*.svg and tables/*.csv, which are small and
belong into the repository, and index.html, PDF, PNG and LaTeX beside them.
"""

from mpmbench.papers.find import find, names
from mpmbench.papers.kit import Campaigns, Chapter, Paper, cell, read_campaigns
from mpmbench.papers.page import build
from mpmbench.report.claims import (
    FAILS,
    HOLDS,
    OPEN,
    PARTLY,
    UNDECIDED,
    Claim,
    Claims,
    SetUp,
)
from mpmbench.report.evidence import MissingRuns, Runs

__all__ = [
    "FAILS",
    "HOLDS",
    "OPEN",
    "PARTLY",
    "UNDECIDED",
    "Campaigns",
    "Chapter",
    "Claim",
    "Claims",
    "MissingRuns",
    "Paper",
    "Runs",
    "SetUp",
    "build",
    "cell",
    "find",
    "names",
    "read_campaigns",
]
