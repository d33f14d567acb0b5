"""Maximum-entropy functions at one point after the other, inside the hull of nodes and on it."""

from mpmbench.core.bases.entropy.locality import allocate, gather, pad
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
from mpmbench.core.compiled import inlined, lean, matrix, vector

# How far, relative to the support, the gradient of a point on the hull is taken inside it.
INWARDS = 2.0**-23
LARGEST_CONDITION = 1e6  # of the covariance of a cloud that needs no further node
HULL_FLOOR = 1e-14  # for gradients in clouds on whose hull the point lies


@inlined
def surroundings(cloud, x, row, work, pull):
    """Find the nodes that count at a point x, and weigh them; returns their number, and reach."""
    found, reach = gather(cloud, x, row, work, pull)
    if found > 0:
        growth = cloud.metric.growth[row] if cloud.metric.growth.shape[0] > 0 else 1.0
        weigh(cloud.form, found, growth, work)
    return found, reach


@lean
def evaluate_range(cloud, work, x, first, last, stored, iterations, starts):
    """Store the functions of points ``first <= p < last``; any split gives the same bits.

    Newton's method starts at the multipliers `starts`, shape (n, dim), and leaves its own there, for
    points on the hull those of the point a little inside; where it fails, it starts again at zero.
    Returns what became of the first point that failed, its number and that of nodes around it. Where
    the stored rows are too narrow, this is the largest number of nodes at one of the points from
    there on.

    On a face of the hull only the nodes of that face have non-zero functions, and lambda is
    infinite. The values there are within the tolerance; the gradient exists only as a limit, taken
    on the way to the middle of the support: the point is evaluated once more a little inside.
    """
    form, axes = cloud.form, cloud.form.axes
    point, multiplier, step, pull = vector(axes), vector(axes), vector(axes), matrix(axes, axes)
    begin = vector(axes)
    narrow, most, width = -1, 0, stored.index.shape[1]
    work.box[0, 0] = -1
    for p in range(first, last):
        far = False  # from zero, where this point begins
        for d in range(len(axes)):
            point[d], begin[d] = x[p, d], starts[p, d]
            far = far or begin[d] != 0.0
            starts[p, d] = 0.0
        on_face, held, iterations[p] = False, 0, 0
        while True:
            found, reach = surroundings(cloud, point, p, work, pull)
            if narrow >= 0 or found > width:
                narrow, most = (p if narrow < 0 else narrow), max(most, found)
                break
            if found == 0:
                return (FLAT if on_face else OUTSIDE), p, held
            for d in range(len(axes)):
                multiplier[d] = begin[d]
            status, steps, on_hull = newton(form, found, reach, LAST_MOVE, work, multiplier, step)
            if not on_face:
                iterations[p] = steps
            if status == DONE and on_hull and not on_face:
                on_face, held = True, found
                hold_limit(cloud.nodes, axes, found, form.tolerance, point, work)
                continue
            if status == DONE and not on_hull:
                residual, _ = finish(axes, found, work, step, 0.0, pull, p, stored)
                if not residual <= form.tolerance * form.spacing * reach:
                    status = STALLED
            if on_face and (status != DONE or on_hull):
                status = FLAT
            if status != DONE and far:
                far, on_face = False, False
                for d in range(len(axes)):
                    point[d], begin[d] = x[p, d], 0.0
                continue
            if status != DONE:
                return status, p, max(found, held)
            stored.size[p] = found
            if on_face:
                put_limit(found, held, p, work, stored)
            for d in range(len(axes)):
                starts[p, d] = multiplier[d] + step[d]
            break
    if narrow >= 0:
        return TOO_NARROW, narrow, most
    return DONE, -1, 0


@lean
def hold_limit(nodes, axes, found, tolerance, point, work):
    """Hold the values on the hull, and move the point a little towards the middle of its nodes."""
    most = total = 0.0
    for k in range(found):
        work.value[k], work.held[k] = work.w[k] * work.e[k], work.number[k]
        most = max(most, work.value[k])
    for k in range(found):
        work.value[k] = 0.0 if work.value[k] <= tolerance * most else work.value[k]
        total += work.value[k]
    for k in range(found):
        work.value[k] /= total
    for d in range(len(axes)):
        inwards = 0.0
        for k in range(found):
            inwards += INWARDS / found * (nodes[work.held[k], d] - point[d])
        point[d] += inwards


@lean
def put_limit(found, held, p, work, stored):
    """Store the values that were held for those at a point a little inside."""
    for k in range(found):
        stored.phi[p, k] = 0.0
        for near in range(held):
            if work.held[near] == stored.index[p, k]:
                stored.phi[p, k] = work.value[near]


@lean
def count_steps(cloud, work, x, iterations):
    """Newton steps at each point until the residual meets the tolerance, -1 where they fail."""
    axes = cloud.form.axes
    point, multiplier, step, pull = vector(axes), vector(axes), vector(axes), matrix(axes, axes)
    work.box[0, 0] = -1
    for p in range(x.shape[0]):
        iterations[p] = -1
        for d in range(len(axes)):
            point[d], multiplier[d] = x[p, d], 0.0
        found, reach = surroundings(cloud, point, p, work, pull)
        if found > 0:
            status, steps, _ = newton(
                cloud.form, found, reach, COUNTED_MOVE, work, multiplier, step
            )
            if status == DONE:
                iterations[p] = steps


@lean
def evaluate_clouds(form, radius, clouds, points, strict, work, stored, failed):
    """Functions of points whose nodes are given; `radius` [m] is what ``form.rim_exponent`` means.

    A point on the hull of its cloud keeps the functions of the last step, whose residual is within
    the tolerance.
    """
    axes = form.axes
    multiplier, step, pull = vector(axes), vector(axes), matrix(axes, axes)
    for d in range(len(axes)):
        for e in range(len(axes)):
            pull[d, e] = 1.0 if d == e else 0.0
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
        for d in range(len(axes)):
            multiplier[d] = 0.0
        status, _, on_hull = newton(form, found, reach, LAST_MOVE, work, multiplier, step)
        failed[p] = True
        if status != DONE:
            continue
        if on_hull:
            for d in range(len(axes)):
                step[d] = 0.0
        residual, condition = finish(axes, found, work, step, HULL_FLOOR, pull, p, stored)
        failed[p] = not (
            residual <= form.tolerance * form.spacing * reach
            and (condition < LARGEST_CONDITION or not strict)
        )


def fill_points(form, radius, clouds, points, strict, stored, failed):
    """The same, in the shape that `CloudBasis` asks for."""
    work = allocate(len(form.axes), stored.index.shape[1])
    evaluate_clouds(form, radius, clouds, points, strict, work, stored, failed)
