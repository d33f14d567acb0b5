"""What the papers on the family of the material point method claim, as the field's own tests decide it."""

from mpmbench.papers.family import chapters, claims
from mpmbench.papers.kit import Paper

PAPER = Paper(
    name="family",
    title="The family of the material point method: what its papers claim",
    reference="Sulsky, Chen and Schreyer 1994; Bardenhagen and Kober 2004; Steffen, Kirby and "
    "Berzins 2008; Sadeghirad, Brannon and Burghardt 2011; Jiang, Schroeder and Teran 2015; "
    "Kamojjala, Brannon, Sadeghirad and Guilkey 2015; Hammerquist and Nairn 2017; Coombs et al. "
    "2018; de Vaucorbeil, Nguyen and Hutchinson 2020; Nairn and Hammerquist 2021.",
    chapters=(
        chapters.vortex_chapter,
        chapters.heavy_bar_chapter,
        chapters.crossing_chapter,
        chapters.transfers_chapter,
        chapters.locking_chapter,
    ),
    claims=tuple(claims.claim),
    summary="Each claim is what a paper is cited for, in our words, with the threshold that it is "
    "judged by. All methods have the same particles, and a verdict holds for these tests and these "
    "sizes. Runs were made on a shared machine: costs are processor times of the solver per "
    "particle and step.",
)
