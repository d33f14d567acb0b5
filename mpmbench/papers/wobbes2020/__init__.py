"""Wobbes, Tielen, Möller and Vuik 2020: comparison and unification of material-point and OTM methods."""

from mpmbench.papers.kit import Paper
from mpmbench.papers.wobbes2020 import (
    ablation,
    bars,
    beyond,
    claims,
    errata,
    plate,
    references,
    survival,
    table1,
)
from mpmbench.report.claims import Claim

CLAIMS = (
    Claim(
        "grid_crossing",
        "MPM-P1 loses second order to grid crossing, OTM-P1 keeps it",
        "Fig. 6",
        claims.grid_crossing,
    ),
    Claim(
        "maxent_accurate",
        "Max-ent functions lead to significantly lower errors than piecewise-linear ones",
        "Fig. 6",
        claims.maxent_accurate,
    ),
    Claim(
        "maxent_order",
        "With max-ent functions the order is between 1 and 2",
        "Fig. 6",
        claims.maxent_order,
    ),
    Claim(
        "spline_order",
        "BSMPM and the unified method have order 3 until a limiting value",
        "Fig. 6",
        claims.spline_order,
    ),
    Claim(
        "splines_inconsistent",
        "Quadratic B-splines are not consistent, so that Algorithm 2 cannot use them",
        "Sect. 4, 7",
        claims.splines_inconsistent,
    ),
    Claim(
        "stays_stable",
        "The unified method is stable with consistent mass where BSMPM breaks (81 nodes)",
        "Sect. 8.2",
        claims.stays_stable,
    ),
    Claim(
        "edge_quadrature",
        "The errors at the right edge are due to quadrature",
        "Fig. 7",
        claims.edge_quadrature,
    ),
    Claim(
        "better_than_mpm",
        "OTM and the unified method are more accurate than their MPM counterparts",
        "Figs. 7, 8",
        claims.better_than_mpm,
    ),
    Claim(
        "unified_best",
        "The unified method and BSMPM have the lowest error and highest order",
        "Fig. 8",
        claims.unified_best,
    ),
    Claim(
        "cheaper_81",
        "B-splines take at most half the time of max-ent functions (512 nodes)",
        "Table 1",
        claims.cheaper_81,
    ),
    Claim(
        "cheaper_82",
        "B-splines are ten times cheaper than max-ent functions",
        "Sect. 8.2",
        claims.cheaper_82,
    ),
    Claim("table1", "The ratios of computational times", "Table 1", claims.table_of_times),
)

PAPER = Paper(
    name="wobbes2020",
    title="Wobbes et al. 2020: material-point and optimal transportation meshfree methods",
    reference="E. D. Wobbes, R. Tielen, M. Möller and C. Vuik, Comparison and unification of material-point and "
    "optimal transportation meshfree methods, Computational Particle Mechanics 8 (2021) 113-133, "
    "doi:10.1007/s40571-020-00316-7.",
    chapters=(
        table1.table1_chapter,
        bars.fig5_chapter,
        bars.fig6_chapter,
        bars.fig7_chapter,
        bars.fig8_chapter,
        survival.breakdown_chapter,
        plate.fig9_chapter,
        plate.plate_orders_chapter,
        errata.errata_chapter,
        ablation.ablation_chapter,
        beyond.large_strain_chapter,
        beyond.quadrature_chapter,
        survival.time_step_chapter,
        beyond.degrees_chapter,
        plate.work_chapter,
        beyond.amplitude_chapter,
        references.references_chapter,
    ),
    claims=CLAIMS,
)
