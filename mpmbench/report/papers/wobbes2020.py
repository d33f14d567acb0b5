"""Wobbes, Tielen, Möller and Vuik 2020: comparison and unification of material-point and OTM methods."""

from mpmbench.report.papers.parts import Campaigns, Chapter, Paper


def fig6_chapter(campaigns: Campaigns) -> Chapter:
    """Convergence on the bar with fixed ends."""
    chapter = Chapter(
        "fig6",
        "Fig. 6: convergence on the bar with fixed ends",
        "MPM and OTM with piecewise-linear functions converge with order 2 on coarse grids; on fine ones MPM loses "
        "it to grid crossing, OTM keeps it. With max-ent functions the order is between 1 and 2. BSMPM and the unified "
        "method have order 3 until a limiting value is reached.",
    )
    chapter.convergence(campaigns["fig6"], ("error_displacement_rms", "error_stress_rms"))
    return chapter


PAPER = Paper(
    name="wobbes2020",
    title="Wobbes et al. 2020: material-point and optimal transportation meshfree methods",
    reference="E. D. Wobbes, R. Tielen, M. Möller and C. Vuik, Comparison and unification of material-point and "
    "optimal transportation meshfree methods, Computational Particle Mechanics 8 (2021) 113-133, "
    "doi:10.1007/s40571-020-00316-7.",
    chapters=(fig6_chapter,),
)
