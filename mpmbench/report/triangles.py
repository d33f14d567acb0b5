"""Slope triangles: where there is room for them beside the curves."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mpmbench.analysis.estimate import OrderEstimate
from mpmbench.analysis.slopes import fitted_order
from mpmbench.report.series import Study

CLOSE_SLOPE = 0.15  # a curve this close to a whole or half order gets its triangle
GAPS = (1 / 2.2, 1 / 4.0, 1 / 8.0, 1 / 16.0)  # of a triangle to its curve, a factor of the error
MARGIN = np.log(1.5)  # room for the markers of a curve, a factor of the error
CLEAR_SHARE = 0.3  # of a floor in the error: levels with more show no slope
Box = tuple[float, float, float, float]


def slope_triangles(
    axes: Axes, study: Study, quantity: str, orders: dict[str, OrderEstimate]
) -> None:
    """One triangle for each whole or half order, beneath the lowest curve of that order."""
    lines = _lines(axes)
    taken: list[Box] = []
    for whole, (x, y) in sorted(_lowest(study, quantity, orders).items()):
        power = whole * (study.axis.power or 1)
        middle = (len(x) - 2) // 2
        intervals = sorted(range(len(x) - 1), key=lambda k: abs(k - middle))
        for gap, k in ((gap, k) for gap in GAPS for k in intervals):
            start, end, base = x[k], x[k + 1], y[k] * gap
            tip = base * (end / start) ** power
            box = min(start, end), max(start, end), tip, base
            if not any(_overlap(box, other) for other in taken) and _free(
                (start, end, tip, base), lines
            ):
                taken.append(box)
                _draw(axes, start, end, tip, base, whole)
                break


def _lines(axes: Axes) -> list[np.ndarray]:
    """Logarithms of the points of all curves, and of lines from the left edge to the right."""
    x = np.concatenate([_points(line)[:, 0] for line in axes.get_lines() if _in_data(axes, line)])
    lines = []
    for line in axes.get_lines():
        points = _points(line)
        if line.get_transform() == axes.get_yaxis_transform(which="grid"):
            points = np.column_stack([[x.min(), x.max()], points[:, 1]])
        elif not _in_data(axes, line):
            continue
        lines.append(np.log(points))
    return lines


def _points(line: Line2D) -> np.ndarray:
    return np.asarray(line.get_xydata(), float)


def _in_data(axes: Axes, line: Line2D) -> bool:
    return bool(line.get_transform() == axes.transData) and len(_points(line)) > 0


def _lowest(
    study: Study, quantity: str, orders: dict[str, OrderEstimate]
) -> dict[float, tuple[np.ndarray, np.ndarray]]:
    """Sizes and errors of the lowest curve of each whole or half order, coarse to fine."""
    lowest: dict[float, tuple[np.ndarray, np.ndarray]] = {}
    for one in study.series:
        estimate = orders.get(one.label)
        if estimate is None or not len(estimate.local):
            continue
        curve = one.finite(quantity).groupby("axis_value")[quantity].median()
        x, y = curve.index.to_numpy(float), curve.to_numpy(float)
        coarse_first = np.argsort(x ** (study.axis.power or 1))[::-1]
        clear = estimate.used & (estimate.floor_share < CLEAR_SHARE)
        x, y = x[coarse_first][clear], y[coarse_first][clear]
        if len(x) < 2:
            continue
        slope = fitted_order(x ** float(study.axis.power or 1), y)
        whole = round(2.0 * slope) / 2.0
        near = whole >= 0.5 and abs(slope - whole) < CLOSE_SLOPE
        if near and (whole not in lowest or y[0] < lowest[whole][1][0]):
            lowest[whole] = (x, y)
    return lowest


def _draw(axes: Axes, start: float, end: float, tip: float, base: float, whole: float) -> None:
    look: Any = {"facecolor": "#eeeeee", "edgecolor": "#777777", "lw": 0.6, "zorder": 1}
    axes.fill([start, end, start], [base, tip, tip], **look)
    inside = start * (end / start) ** 0.12, tip * (base / tip) ** 0.24
    side = "left" if end > start else "right"
    axes.text(*inside, f"{whole:g}", ha=side, va="center", size=7, color="#444444")


def _overlap(one: Box, other: Box) -> bool:
    """Whether two boxes (left, right, bottom, top) share an area."""
    return one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]


def _free(corners: tuple[float, float, float, float], lines: list[np.ndarray]) -> bool:
    """Whether no curve, given by the logarithms of its points, runs through a triangle.

    Its hypotenuse goes from (start, base) to (end, tip), and its foot lies at the tip's height.
    """
    start, end, tip, base = np.log(corners)
    for points in lines:
        points = points[np.argsort(points[:, 0])]
        low, high = max(min(start, end), points[0, 0]), min(max(start, end), points[-1, 0])
        x = np.linspace(low, high, 50)
        y = np.interp(x, points[:, 0], points[:, 1])
        hypotenuse = base + (tip - base) * (x - start) / (end - start)
        if low <= high and np.any((y > tip - MARGIN) & (y < hypotenuse + MARGIN)):
            return False
    return True
