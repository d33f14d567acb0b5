"""The updated-Lagrangian solver of Iaconeta et al. 2017, for FEM, implicit MPM and GMM alike.

The methods differ only in where the shape functions of a step come from. During Newton's iteration
the values N stay as they were at the start of the step, and the gradients are pushed forward by the
inverse of the increment: ``grad N = DF^-T grad_n N`` with ``DF = I + sum_I Du_I (x) grad_n N_I``
and ``F = DF F_n``.
"""
