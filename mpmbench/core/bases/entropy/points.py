"""Maximum-entropy functions at one point after the other, inside the hull of nodes and on it."""

import numpy as np

from mpmbench.core.bases.entropy.locality import allocate, gather, pad, push
from mpmbench.core.bases.entropy.priors import weigh
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
from mpmbench.core.compiled import compiled, inlined, lean, matrix, vector

# How far, relative to the support, the gradient of a point on the hull is taken inside it.
INWARDS = 2.0**-23
LARGEST_CONDITION = 1e6  # of the covariance of a cloud that needs no further node
HULL_FLOOR = 1e-14  # for gradients in clouds on whose hull the point lies


@inlined
def surroundings(cloud, x, p, row, work):
    """Find the nodes that count at a point, and weigh them; returns their number, and reach."""
    found, reach = gather(cloud, x, p, row, work)
    growth = cloud.metric.growth[row] if cloud.metric.growth.shape[0] > 0 else 1.0
    if found > 0:
        weigh(cloud.form, found, growth, work)
    return found, reach


@inlined
def evaluate_inside(cloud, x, p, work, row, stored):
    """Write the functions at point `p` of `x` to row `row`.

    Returns what becomes of the point, the numbers of its functions and of Newton's steps, and
    whether it lies on the hull.
    """
    form = cloud.form
    found, reach = surroundings(cloud, x, p, row, work)
    if found == 0:
        return OUTSIDE, 0, 0, False
    if found > stored.index.shape[1]:
        return TOO_NARROW, found, 0, False
    step = vector(form.axes)
    status, steps, on_hull = newton(form, found, reach, LAST_MOVE, work, step)
    if status != DONE or on_hull:
        return status, found, steps, on_hull
    residual, _ = finish(form.axes, found, work, step, 0.0, row, stored)
    if not residual <= form.tolerance * form.spacing * reach:
        return STALLED, found, steps, False
    if cloud.metric.growth.shape[0] > 0:
        push(cloud, row, found, stored.grad_phi)
    return DONE, found, steps, False


@lean
def evaluate_on_hull(cloud, x, p, found, work, row, stored):
    """The same for a point on the hull: values of the limit, and gradients from a little inside.

    On a face of the hull only the nodes of that face have non-zero functions, and lambda is
    infinite. The values there are within the tolerance; the gradient exists only as a limit, taken
    on the way to the middle of the support.
    """
    form = cloud.form
    inside = matrix((0.0,), form.axes)
    first = np.int64(0)  # for a literal 0 all that is called here would be compiled once more
    for d in range(len(form.axes)):
        inside[0, d] = x[p, d]
    for k in range(found):
        for d in range(len(form.axes)):
            inside[0, d] += INWARDS / found * (cloud.nodes[work.number[k], d] - x[p, d])
    status, size, _, again = evaluate_inside(cloud, inside, first, work, row, stored)
    if status != DONE or again:
        return (TOO_NARROW if status == TOO_NARROW else FLAT), max(size, found)

    step = vector(form.axes)
    found, reach = surroundings(cloud, x, p, row, work)
    newton(form, found, reach, LAST_MOVE, work, step)
    most = total = 0.0
    for k in range(found):
        work.w[k] *= work.e[k]
        most += work.w[k]
    for k in range(found):
        work.w[k] = 0.0 if work.w[k] <= form.tolerance * most else work.w[k]
        total += work.w[k]
    for k in range(size):
        stored.phi[row, k] = 0.0
        for near in range(found):
            if work.number[near] == stored.index[row, k]:
                stored.phi[row, k] = work.w[near] / total
    return DONE, size


@lean
def evaluate_range(cloud, work, x, first, last, stored, iterations):
    """Store the functions of points ``first <= p < last``; any split gives the same bits.

    Returns what became of the first point that failed, its number and that of nodes around it.
    """
    for p in range(first, last):
        status, found, steps, on_hull = evaluate_inside(cloud, x, p, work, p, stored)
        if status == DONE and on_hull:
            status, found = evaluate_on_hull(cloud, x, p, found, work, p, stored)
        iterations[p] = steps
        if status != DONE:
            return status, p, found
        stored.size[p] = found
    return DONE, -1, 0


@lean
def widest(cloud, work, x):
    """Largest number of nodes that count at one of the points."""
    most = 0
    for p in range(x.shape[0]):
        most = max(most, gather(cloud, x, p, p, work)[0])
    return most


@lean
def count_steps(cloud, work, x, iterations):
    """Newton steps at each point until the residual meets the tolerance, -1 where they fail."""
    step = vector(cloud.form.axes)
    for p in range(x.shape[0]):
        iterations[p] = -1
        found, reach = surroundings(cloud, x, p, p, work)
        if found > 0:
            status, steps, _ = newton(cloud.form, found, reach, COUNTED_MOVE, work, step)
            if status == DONE:
                iterations[p] = steps


@lean
def evaluate_clouds(form, radius, clouds, points, strict, work, stored, failed):
    """Functions of points whose nodes are given; `radius` [m] is what ``form.rim_exponent`` means.

    A point on the hull of its cloud keeps the functions of the last step, whose residual is within
    the tolerance.
    """
    axes = form.axes
    step = vector(axes)
    for q in range(points.shape[0]):
        p = points[q]
        found, reach = stored.size[p], clouds.radius[p]
        for k in range(found):
            i = stored.index[p, k]
            square = 0.0
            for d in range(len(axes)):
                work.dx[d, k] = clouds.nodes[i, d] - clouds.x[p, d]
                square += work.dx[d, k] * work.dx[d, k]
            work.number[k], work.rr[k] = i, square / (reach * reach)
        pad(axes, found, work)
        weigh(form, found, reach / radius, work)
        status, _, on_hull = newton(form, found, reach, LAST_MOVE, work, step)
        failed[p] = True
        if status != DONE:
            continue
        if on_hull:
            for d in range(len(axes)):
                step[d] = 0.0
        residual, condition = finish(axes, found, work, step, HULL_FLOOR, p, stored)
        failed[p] = not (
            residual <= form.tolerance * form.spacing * reach
            and (condition < LARGEST_CONDITION or not strict)
        )


@compiled
def fill_points(form, radius, clouds, points, strict, stored, failed):
    """The same, in the shape that `CloudBasis` asks for."""
    work = allocate(form.axes, stored.index.shape[1])
    evaluate_clouds(form, radius, clouds, points, strict, work, stored, failed)
