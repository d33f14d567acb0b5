"""The updated-Lagrangian solver of Iaconeta et al. 2017: one residual and one tangent for FEM, implicit MPM and GMM.

The methods differ only in where the shape functions of a step come from. During Newton's iteration
the values N stay as they were at the start of the step, and the gradients are pushed forward by the
inverse of the increment: ``grad N = DF^-T grad_n N`` with ``DF = I + sum_I Du_I (x) grad_n N_I``
and ``F = DF F_n``.
"""

from mpmbench.core.choices import Choices
from mpmbench.core.errors import NotApplicable


def check_choices(choices: Choices) -> None:
    """Refuse combinations that make no sense with an implicit time loop.

    Raises
    ------
    NotApplicable
        With the reason.
    """
    loop = f"method.time={choices.time}"
    if choices.moving and choices.transfer != "nodal":
        raise NotApplicable(
            f"{loop} with moving nodes keeps velocities on the nodes: it needs method.transfer=nodal"
        )
    if not choices.moving and not choices.frozen and choices.transfer != "flip":
        raise NotApplicable(
            f"{loop} with nodes that stay updates particle velocities by the trapezoidal rule: it needs "
            "method.transfer=flip"
        )
    if choices.stress_update != "usl":
        raise NotApplicable(
            f"{loop} finds stress and displacement together: it needs method.stress_update=usl"
        )
    if choices.dirichlet != "direct" and (choices.frozen or not choices.moving):
        raise NotApplicable(
            f"method.dirichlet={choices.dirichlet} holds points of the material: it needs method.nodes=moving and "
            "method.shape_functions=updated"
        )
    if choices.ghost_stiffness > 0.0 and (choices.moving or choices.frozen):
        raise NotApplicable(
            "method.ghost_stiffness > 0 needs a background grid that particles move through"
        )
