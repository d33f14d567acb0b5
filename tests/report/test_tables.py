"""Small parts of tables and figures, by themselves."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import pandas as pd
import pytest

from mpmbench.report import figures
from mpmbench.report.series import floor_of
from mpmbench.report.tables import Cell, ratio


def test_a_ratio_needs_two_numbers() -> None:
    two, four, failed, nothing = Cell(2.0, ("a",)), Cell(4.0, ("b",)), Cell("diverged"), Cell(0.0)
    assert ratio(four, two) == Cell(2.0, ("b", "a"))
    for above, below in ((failed, two), (two, failed), (two, nothing), (failed, failed)):
        assert ratio(above, below) == Cell()


@pytest.mark.parametrize(
    ("floors", "floor"),
    (([1.0, 1.0], 1.0), ([1.0, 2.0], None), ([], None), ([None, 3.0], 3.0)),
)
def test_a_floor_is_one_on_which_all_runs_agree(floors: list[float], floor: float | None) -> None:
    runs = pd.DataFrame({"predicted_temporal_floor": pd.Series(floors, dtype=float)})
    assert floor_of(SimpleNamespace(ok=runs)) == floor
    assert floor_of(SimpleNamespace(ok=pd.DataFrame())) is None


@pytest.mark.parametrize(("high", "label"), ((5.0, "2"), (1e4, None)))
def test_short_logarithmic_axes_have_more_ticks(high: float, label: str | None) -> None:
    figure, axes = plt.subplots()
    axes.set_yscale("log")
    axes.set_ylim(1.0, high)
    figures.log_ticks(axes.yaxis)
    figure.draw_without_rendering()
    labels = [text.get_text() for text in axes.yaxis.get_ticklabels(which="both")]
    assert ("2" in labels) == (label is not None)
    assert not any(text.get_text() for text in axes.yaxis.get_ticklabels(minor=True))
    plt.close(figure)
