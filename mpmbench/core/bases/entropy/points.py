"""Maximum-entropy functions at one point after the other, inside the hull of the nodes and on it."""

import numpy as np

from mpmbench.core.bases.entropy.locality import push
from mpmbench.core.bases.entropy.priors import gather, weigh
from mpmbench.core.bases.entropy.solve import (
    COUNTED_MOVE,
    DONE,
    FLAT,
    LAST_MOVE,
    OUTSIDE,
    STALLED,
    TOO_NARROW,
    finish,
    newton,
)
from mpmbench.core.compiled.exponentials import lean, matrix, vector

INWARDS = (
    2.0**-23
)  # how far, relative to the support, the gradient of a point on the hull is taken inside it


@lean
def evaluate_inside(cloud, x, p, work, row, index, phi, grad_phi):  # type: ignore[no-untyped-def]
    """Functions at point `p` of `x`, written to row `row`; returns status, number of functions or of steps, on_hull."""
    found, reach = gather(cloud, x, p, row, work)
    if found == 0:
        return OUTSIDE, 0, 0, False
    if found > index.shape[1]:
        return TOO_NARROW, found, 0, False
    step = vector(cloud.axes)
    weigh(cloud, found, row, work)
    status, iterations, on_hull = newton(cloud, found, reach, LAST_MOVE, work, step)
    if status != DONE or on_hull:
        return status, found, iterations, on_hull
    residual = finish(cloud.axes, found, work, step, row, index, phi, grad_phi)
    if not residual <= cloud.tolerance * cloud.spacing * reach:
        return STALLED, found, iterations, False
    if cloud.metric.growth.shape[0] > 0:
        push(cloud, row, found, grad_phi)
    return DONE, found, iterations, False


@lean
def evaluate_on_hull(cloud, x, p, found, work, row, index, phi, grad_phi):  # type: ignore[no-untyped-def]
    """The same for a point on the hull: values of the limit, and gradients from a little inside.

    On a face of the hull only the nodes of that face have non-zero functions, and lambda is
    infinite. The values there are within the tolerance; the gradient exists only as a limit, taken
    on the way to the middle of the support.
    """
    inside = matrix((0.0,), cloud.axes)
    first = np.int64(0)  # for a literal 0 all that is called here would be compiled once more
    for d in range(len(cloud.axes)):
        inside[0, d] = x[p, d]
    for k in range(found):
        for d in range(len(cloud.axes)):
            inside[0, d] += INWARDS / found * (cloud.nodes[work.number[k], d] - x[p, d])
    status, size, _, again = evaluate_inside(cloud, inside, first, work, row, index, phi, grad_phi)
    if status != DONE or again:
        return (TOO_NARROW if status == TOO_NARROW else FLAT), max(size, found)

    step = vector(cloud.axes)
    found, reach = gather(cloud, x, p, row, work)
    weigh(cloud, found, row, work)
    newton(cloud, found, reach, LAST_MOVE, work, step)
    most = total = 0.0
    for k in range(found):
        work.w[k] *= work.e[k]
        most += work.w[k]
    for k in range(found):
        work.w[k] = 0.0 if work.w[k] <= cloud.tolerance * most else work.w[k]
        total += work.w[k]
    for k in range(size):
        phi[row, k] = 0.0
        for near in range(found):
            if work.number[near] == index[row, k]:
                phi[row, k] = work.w[near] / total
    return DONE, size


@lean
def evaluate_range(cloud, work, x, first, last, size, index, phi, grad_phi, iterations):  # type: ignore[no-untyped-def]
    """Store the functions of points ``first <= p < last``; any split into ranges gives the same bits.

    Returns
    -------
    status, point, found
        DONE, or what became of the first point that failed, with the number of nodes around it.
    """
    for p in range(first, last):
        status, found, steps, on_hull = evaluate_inside(cloud, x, p, work, p, index, phi, grad_phi)
        if status == DONE and on_hull:
            status, found = evaluate_on_hull(cloud, x, p, found, work, p, index, phi, grad_phi)
        iterations[p] = steps
        if status != DONE:
            return status, p, found
        size[p] = found
    return DONE, -1, 0


@lean
def widest(cloud, work, x):  # type: ignore[no-untyped-def]
    """Largest number of nodes whose supports cover one of the points."""
    most = 0
    for p in range(x.shape[0]):
        most = max(most, gather(cloud, x, p, p, work)[0])
    return most


@lean
def count_steps(cloud, work, x, iterations):  # type: ignore[no-untyped-def]
    """Newton steps at each point until the residual meets the tolerance, -1 where the iteration fails."""
    step = vector(cloud.axes)
    for p in range(x.shape[0]):
        iterations[p] = -1
        found, reach = gather(cloud, x, p, p, work)
        if found > 0:
            weigh(cloud, found, p, work)
            status, steps, _ = newton(cloud, found, reach, COUNTED_MOVE, work, step)
            if status == DONE:
                iterations[p] = steps
