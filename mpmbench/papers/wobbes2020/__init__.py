"""Wobbes, Tielen, Möller and Vuik 2020: material-point and OTM methods, and their union."""

from mpmbench.papers.kit import Paper
from mpmbench.papers.wobbes2020 import (
    ablation,
    bars,
    beyond,
    claims,
    errata,
    functions,
    plate,
    references,
    stress_update,
    survival,
    table1,
)

PAPER = Paper(
    name="wobbes2020",
    title="Wobbes et al. 2020: material-point and optimal transportation meshfree methods",
    reference="E. D. Wobbes, R. Tielen, M. Möller and C. Vuik, Comparison and unification of material-point and "
    "optimal transportation meshfree methods, Computational Particle Mechanics 8 (2021) 113-133, "
    "doi:10.1007/s40571-020-00316-7.",
    chapters=(
        functions.functions_chapter,
        table1.table1_chapter,
        bars.fig5_chapter,
        bars.fig6_chapter,
        bars.fig7_chapter,
        bars.fig8_chapter,
        survival.breakdown_chapter,
        stress_update.stress_update_chapter,
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
    claims=tuple(claims.claim),
    set_ups=claims.SET_UPS,
    stated=claims.IN_WORDS,
)
