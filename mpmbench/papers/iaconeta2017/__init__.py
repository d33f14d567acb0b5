"""Iaconeta, Larese, Rossi and Guo 2017: implicit material points and Galerkin meshfree."""

from mpmbench.papers.iaconeta2017 import (
    beyond,
    bounces,
    cantilever,
    claims,
    disk,
    soil,
    undisclosed,
)
from mpmbench.papers.kit import Paper

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
        undisclosed.mls_disk_chapter,
        bounces.bounces_chapter,
        soil.soil_chapter,
        undisclosed.mls_soil_chapter,
        soil.animation_chapter,
        soil.soil_check_chapter,
        cantilever.radius_chapter,
        cantilever.load_steps_chapter,
        disk.glued_chapter,
        beyond.dynamic_chapter,
        beyond.patch_chapter,
    ),
    claims=tuple(claims.claim),
    set_ups=claims.SET_UPS,
    stated=claims.IN_WORDS,
)
