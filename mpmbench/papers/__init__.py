"""Reports on papers: what a paper printed, what the runs say, and a verdict on each of its claims.

A paper is one module (or package) here with the name of its folder of experiments, and one object
in it::

    experiments/li2009/bar.yaml            runs go to results/li2009/bar
    mpmbench/papers/li2009.py              PAPER = Paper(...); the report goes to reports/li2009

    PAPER = Paper(
        name="li2009",
        title="Optimal transportation meshfree approximation schemes",
        reference="Li, Habbal and Ortiz, Int. J. Numer. Meth. Engng 83 (2010) 1541-1579",
        chapters=(bar_chapter, ...),
        claims=(Claim("order", "OTM converges with order 2", "Fig. 3", second_order), ...),
    )

A chapter is a function of the campaigns, by the names of their experiments, and returns a
`Chapter`::

    def bar_chapter(campaigns: Campaigns) -> Chapter:
        chapter = Chapter("bar", "Fig. 3: bar", statement="The paper: OTM converges with order 2.")
        chapter.convergence(campaigns["bar"])                            # figures, orders and
        errors of a sweep chapter.draw("profile", "Stress", "Caption.", figure, files)     # any
        matplotlib figure, and what it shows chapter.animate("collapse", "Collapse", "Caption.",
        gif, files)  # the bytes of an animated GIF chapter.add(table)
        # a `mpmbench.report.tables.Table` chapter.notes.append("A sentence.") return chapter

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
