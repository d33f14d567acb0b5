"""Iaconeta, Larese, Rossi and Guo 2017: implicit material point method and Galerkin meshfree method."""

from mpmbench.papers.iaconeta2017 import beyond, cantilever, claims, disk, soil
from mpmbench.papers.kit import Paper
from mpmbench.report.claims import Claim

CLAIMS = (
    Claim(
        "quadratic",
        "All the methods have a quadratic rate of convergence",
        "Fig. 7",
        claims.quadratic,
    ),
    Claim(
        "same_limit",
        "-0.67433 m is equally reached by all the methods",
        "Sect. 5.1",
        claims.same_limit,
    ),
    Claim(
        "curves", "UL-FEM, MPM and GMM-MLS error curves coincide", "Fig. 7", claims.curves_coincide
    ),
    Claim(
        "lme",
        "GMM-LME is less accurate than GMM-MLS in statics",
        "Fig. 7",
        claims.lme_less_accurate,
    ),
    Claim(
        "contact",
        "By using either MPM or GMM, the contact is implicitly caught",
        "Sect. 5.2",
        claims.contact,
    ),
    Claim(
        "gmm",
        "In the dynamic case GMM is more accurate than MPM",
        "Table 1",
        claims.gmm_more_accurate,
    ),
    Claim(
        "lme_dynamic",
        "There, GMM-LME has smaller errors than GMM-MLS",
        "Table 1",
        claims.lme_before_mls,
    ),
    Claim(
        "cost",
        "GMM takes 10 % (MLS) and 8.5 % to 16 % (LME) more time than MPM",
        "Table 1",
        claims.gmm_costs_more,
    ),
    Claim(
        "columns",
        "The final configurations of MPM, GMM-LME and GMM-MLS are almost coincident",
        "Fig. 10",
        claims.coincident_columns,
    ),
    Claim(
        "robust",
        "MPM is more robust than GMM under extremely large deformation",
        "Sect. 5.3",
        claims.mpm_robust,
    ),
)

PAPER = Paper(
    name="iaconeta2017",
    title="Iaconeta et al. 2017: implicit material point and Galerkin meshfree methods",
    reference="I. Iaconeta, A. Larese, R. Rossi and Z. Guo, Comparison of a Material Point Method and a Galerkin "
    "Meshfree Method for the Simulation of Cohesive-Frictional Materials, Materials 10 (2017) "
    "1150, doi:10.3390/ma10101150.",
    chapters=(
        cantilever.fields_chapter,
        cantilever.fig7_chapter,
        disk.table1_chapter,
        soil.soil_chapter,
        soil.animation_chapter,
        soil.soil_check_chapter,
        cantilever.radius_chapter,
        cantilever.load_steps_chapter,
        disk.glued_chapter,
        beyond.dynamic_chapter,
        beyond.patch_chapter,
    ),
    claims=CLAIMS,
)
