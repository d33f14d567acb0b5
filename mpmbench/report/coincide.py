"""Curves that lie upon each other, and what a caption says of them and of the choices of curves."""

import numpy as np
from matplotlib.figure import Figure

from mpmbench.report.series import BASIS_NAMES, METHOD_NAMES, Series, Study
from mpmbench.results import differences

SAME = 0.01  # largest relative difference, at any level, of curves that coincide


def coinciding(study: Study, quantity: str) -> list[list[Series]]:
    """Groups of curves whose errors agree within `SAME` at every level."""
    groups: list[list[Series]] = []
    for one in study.series:
        if not len(one.finite(quantity)):
            continue
        for group in groups:
            if _coincide(group[0], one, quantity):
                group.append(one)
                break
        else:
            groups.append([one])
    return [group for group in groups if len(group) > 1]


def _coincide(one: Series, other: Series, quantity: str) -> bool:
    a, b = (
        curve.finite(quantity).groupby("axis_value")[quantity].median() for curve in (one, other)
    )
    return bool(a.index.equals(b.index) and np.all(np.abs(a - b) <= SAME * np.minimum(a, b)))


def depths(study: Study, quantity: str) -> dict[str, int]:
    """How far beneath others a curve is to be drawn, by its label: the last of a group lies on top."""
    return {
        one.label: len(group) - 1 - k
        for group in coinciding(study, quantity)
        for k, one in enumerate(group)
    }


def caption(study: Study, quantity: str, figure: Figure) -> str:
    """What a figure of errors shows, what coincides in it, and what else differs between its curves."""
    legend = [text.get_text() for box in figure.legends for text in box.get_texts()]
    parts = []
    if study.axis.power is not None:
        parts.append(
            "Behind each curve its least-squares slope, with the range of its local slopes."
            if any(": " in entry for entry in legend)
            else "The slope of each curve is in the table of orders."
        )
        parts += ["Triangles show slopes."] if figure.axes[0].patches else []
    if any(entry.startswith("failed") for entry in legend):
        parts.append("Crosses: runs that failed; they enter no fit.")
    return " ".join([*parts, *sentences(study, quantity)])


def sentences(study: Study, quantity: str) -> list[str]:
    """Which curves coincide."""
    found = []
    for group in coinciding(study, quantity):
        *first, last = (one.label for one in group)
        found.append(f"{'; '.join(first)} and {last} coincide (within 1 % at all levels).")
    return found


def differing(study: Study) -> str:
    """In what the curves differ besides method, basis and what is swept; nothing if in nothing."""
    found = differences.sentences(study.differences, METHOD_NAMES | BASIS_NAMES)
    if not found:
        return ""
    return f"The curves differ in more than what is swept. {'; '.join(found)}."
