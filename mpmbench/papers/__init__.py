"""Reports on papers: what a paper printed, what the runs say, and a verdict on each of its claims.

A paper is one folder, here or in ``papers/`` of a folder of plug-ins (`MPMBENCH_PLUGINS`)::

    papers/bar_orders/paper.py             PAPER = Paper(...); or __init__.py
    papers/bar_orders/experiments/bar.yaml experiments=bar_orders/bar; results/bar_orders/bar
    papers/bar_orders/plugins/             options and code that its experiments bring along

``mpmbench/samples/paper`` is a whole one. The experiments may stand in ``experiments/bar_orders``
beside ``papers`` as well, with their ``plugins``. The file has one object::

    PAPER = Paper(
        name="bar_orders",
        title="Optimal transportation meshfree approximation schemes",
        reference="Li, Habbal and Ortiz, Int. J. Numer. Meth. Engng 83 (2010) 1541-1579",
        chapters=(bar_chapter, ...),
        claims=(
            Claim(
                "order",
                "OTM converges with order 2",
                "Fig. 3",
                measure=lambda runs: {"p": runs.order("bar", ERROR, method="otm").order},
                holds=lambda p: abs(p - 2.0) < 0.3,
                sentence="p = {p:.2f}",
            ),
        ),
    )

A chapter is a function of the campaigns, by the names of their experiments, and returns a
`Chapter`::

    def bar_chapter(campaigns: Campaigns) -> Chapter:
        page = Chapter("bar", "Fig. 3: bar", statement="The paper: OTM converges with order 2.")
        page.convergence(campaigns["bar"])  # figures, orders and errors of a sweep
        page.draw("profile", "Stress", "Caption.", figure, files)  # any matplotlib figure
        page.animate("collapse", "Collapse", "Caption.", gif, files)  # bytes of an animated GIF
        page.tabulate("ends", "At the end", columns, rows)  # rows of `mpmbench.report.tables.Cell`
        page.notes.append("A sentence.")
        return page

Runs that are missing raise `MissingRuns` (a `Campaigns` does so by itself): the page then says so
in the place of that chapter. Cells of tables name their result files: `kit.cell(campaigns, "bar",
"error_displacement_rms", method="otm")` gives the number of the one run that matches, with its
file, or its status when it did not finish. In a `Campaign` of a paper the index of the runs is
``<experiment>/<file>``, so that names are unique on the page.

`build` writes ``reports/<name>/``: README.md, figures/*.svg and tables/*.csv, which are small and
belong into the repository, and index.html, PDF, PNG and LaTeX beside them.
"""

from mpmbench.papers.find import find, names
from mpmbench.papers.kit import Campaigns, Chapter, Paper, cell, read_campaigns
from mpmbench.papers.page import build
from mpmbench.report.claims import FAILS, HOLDS, UNDECIDED, Claim, MissingRuns, Runs

__all__ = [
    "FAILS",
    "HOLDS",
    "UNDECIDED",
    "Campaigns",
    "Chapter",
    "Claim",
    "MissingRuns",
    "Paper",
    "Runs",
    "build",
    "cell",
    "find",
    "names",
    "read_campaigns",
]
