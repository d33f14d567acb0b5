"""Li 2009, chapters 2 to 4: local max-ent functions, the isothermal shock, and stability of OTM."""

from mpmbench.papers.kit import Paper
from mpmbench.papers.li2009 import bar, claims, functions, shock, space
from mpmbench.report.claims import Claim

CLAIMS = (
    Claim(
        "newton_counts",
        "Mean Newton steps per sample by gamma and tolerance",
        "Table 2.1",
        claims.newton_counts,
    ),
    Claim(
        "line_search",
        "Newton's method needs a line search",
        "Sect. 2.2.4",
        claims.line_search_needed,
    ),
    Claim(
        "velocity_rate",
        "The velocity converges with 2.13, better than quadratic",
        "Fig. 4.4",
        claims.velocity_rate,
    ),
    Claim("density_rate", "The density converges with 1.88", "Fig. 4.5", claims.density_rate),
    Claim("error_level", "The errors remain below 1e-7", "Sect. 4.1.3", claims.error_level),
    Claim(
        "dimensions",
        "The shock is also followed in two and three dimensions",
        "Sect. 4.1.3",
        claims.more_dimensions,
    ),
    Claim(
        "irregular",
        "Convergence does not depend on structured nodes",
        "Sects. 1, 4",
        claims.irregular_density,
    ),
    Claim(
        "bar",
        "OTM agrees with finite elements, also on nonuniform nodes",
        "Figs. 4.12, 4.13",
        claims.bar_as_fem,
    ),
    Claim("sph", "Standard SPH cannot solve the bar in tension", "Sect. 4.2.2", claims.sph_fails),
    Claim(
        "nodal_integration",
        "A spurious mode occurs in the bar with nodal integration",
        "Sect. 4.2.2",
        claims.nodal_integration,
    ),
    Claim(
        "tensile_instability",
        "OTM completely avoids the tensile instability",
        "Sect. 4.2.1",
        claims.avoids_tensile_instability,
    ),
    Claim(
        "energy",
        "The discrete motion of Eqs. 3.88-3.91 keeps its energy",
        "Sect. 3.2.3",
        claims.energy_kept,
    ),
)

PAPER = Paper(
    name="li2009",
    title="Li 2009: the optimal transportation method in solid mechanics, chapters 2 to 4",
    reference="B. Li, The Optimal Transportation Method in Solid Mechanics, PhD thesis, California Institute of "
    "Technology, Pasadena, 2009.",
    summary="The isothermal shock, the elastic bar and the shape functions of the thesis, with its parameters where it "
    "gives them; explicit linear finite elements, the other methods of this program, SPH with an "
    "Eulerian kernel and nodal integration stand beside OTM. Errors of the shock are those of Eq. "
    "4.27: the largest over time.",
    chapters=(
        functions.table_chapter,
        functions.boundary_chapter,
        functions.gamma_chapter,
        shock.exact_chapter,
        shock.convergence_chapter,
        shock.irregular_chapter,
        shock.particles_chapter,
        shock.mass_chapter,
        space.strip_chapter,
        space.cylinder_chapter,
        bar.bar_chapter,
        bar.energy_chapter,
        bar.stability_chapter,
    ),
    claims=CLAIMS,
)
