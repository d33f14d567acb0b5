"""A report on one statement: MPM with linear functions converges with order 2.

With the folder above ``papers`` in ``MPMBENCH_PLUGINS``, ``python -m mpmbench reproduce bar_orders``
runs the experiments beside this file and writes ``reports/bar_orders/``.
"""

from mpmbench.papers import FAILS, HOLDS, Campaigns, Chapter, Claim, Paper, Runs

ERROR = "error_displacement_rms"


def bar_chapter(campaigns: Campaigns) -> Chapter:
    """Errors and orders of all methods."""
    page = Chapter("bar", "The bar with fixed ends", statement="MPM converges with order 2.")
    page.convergence(campaigns["bar"], (ERROR,))
    return page


def second_order(runs: Runs) -> tuple[str, str]:
    """Order of MPM with linear functions: the answer, and a sentence with the number."""
    found = runs.order("bar", ERROR, method="mpm", basis="linear")
    return (HOLDS if abs(found.slope - 2.0) < 0.3 else FAILS), f"p = {found.slope:.2f}"


PAPER = Paper(
    name="bar_orders",
    title="Orders on a bar",
    reference="A sample of a paper's report.",
    chapters=(bar_chapter,),
    claims=(Claim("order", "MPM converges with order 2", "Fig. 1", second_order),),
)
