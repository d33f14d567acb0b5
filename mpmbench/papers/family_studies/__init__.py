"""Studies of the family that no single paper has: a falling cantilever, waves in a stretched bar, crossing cells."""

from mpmbench.papers.family_studies import chapters, claims
from mpmbench.papers.kit import Paper

PAPER = Paper(
    name="family_studies",
    title="The family of the material point method on three studies of its own",
    reference="Iaconeta, Larese, Rossi and Guo 2017 (cantilever); Belytschko, Guo, Liu and Xiao 2000, and Li 2009, "
    "Fig. 4.10 (stability of kernels); Chen, Wu, Yoon and You 2001 (nodal integration); Zhang, Ma and Giguere "
    "2011 (dual domains).",
    chapters=(
        chapters.cantilever_chapter,
        chapters.waves_chapter,
        chapters.traction_chapter,
    ),
    claims=tuple(claims.claim),
    summary="All methods have the same particles. Each claim is what a paper is cited for, in our words, with the "
    "threshold that it is judged by.",
)
