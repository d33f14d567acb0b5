"""Li 2009, chapters 2 to 5: local max-ent functions, isothermal shock, stability of OTM, impact."""

from mpmbench.papers.kit import Paper
from mpmbench.papers.li2009 import (
    bar,
    claims,
    collisions,
    contact_claims,
    entropy,
    films,
    functions,
    impact,
    inelastic,
    locality,
    rod_locking,
    rod_stress,
    round_bodies,
    shock,
    space,
    taylor,
)

PAPER = Paper(
    name="li2009",
    title="Li 2009: the optimal transportation method in solid mechanics, chapters 2 to 5",
    reference="B. Li, The Optimal Transportation Method in Solid Mechanics, PhD thesis, California Institute of "
    "Technology, Pasadena, 2009.",
    summary="Shape functions, the isothermal shock, the elastic bar, Taylor's rod, contact and impact of the thesis, "
    "with its parameters where it gives them; explicit linear finite elements, the other methods of this program, SPH "
    "with an Eulerian kernel and nodal integration stand beside OTM. Errors of the shock are those of Eq. "
    "4.27: the largest over time.",
    chapters=(
        entropy.maxent_chapter,
        entropy.data_chapter,
        functions.table_chapter,
        functions.boundary_chapter,
        functions.gamma_chapter,
        inelastic.inelastic_chapter,
        shock.exact_chapter,
        shock.convergence_chapter,
        shock.irregular_chapter,
        shock.particles_chapter,
        shock.mass_chapter,
        space.strip_chapter,
        space.cylinder_chapter,
        bar.bar_chapter,
        locality.locality_chapter,
        bar.energy_chapter,
        bar.stability_chapter,
        taylor.taylor_chapter,
        taylor.methods_chapter,
        rod_locking.locking_chapter,
        rod_stress.stress_chapter,
        taylor.copper_chapter,
        collisions.rules_chapter,
        collisions.slip_chapter,
        collisions.cubes_chapter,
        collisions.open_cubes_chapter,
        round_bodies.round_chapter,
        impact.impact_chapter,
        impact.cells_chapter,
        impact.open_chapter,
        films.films_chapter,
    ),
    claims=tuple(contact_claims.claim),
    set_ups=claims.SET_UPS,
    stated=claims.IN_WORDS,
)
