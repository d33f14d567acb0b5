"""The study of functions: known values of each basis, and a pentagon's functions without locality."""

from typing import Any

import numpy as np
import pytest

from mpmbench.case import read
from mpmbench.core.errors import BadSetting, NotApplicable
from tests.core.support import compose, run


def functions(basis: str, **changes: Any) -> Any:
    """Result of a study on a line of 8 cells."""
    return run("shape_functions", "evaluate", basis, problem__samples_per_axis=80, **changes)


def middle(found: Any) -> int:
    """Number of the function in the middle of the line."""
    return int(np.abs(found.shown_nodes.values[:, 0] - 0.5).argmin())


@pytest.mark.parametrize("basis", ["linear", "bspline", "maxent"])
def test_functions_sum_up_to_one_and_to_the_point(basis: str) -> None:
    found = functions(basis)
    assert float(found.error_partition_of_unity) < 1e-13
    assert float(found.error_completeness) < 1e-12
    assert float(found.smallest_value) > -1e-14 and float(found.largest_value) < 1.0
    # the gradients are those of the values: differences over two samples, but for kinks
    phi, slope = found.shape_function.values, found.shape_function_gradient.values[:, :, 0]
    difference = (phi[2:] - phi[:-2]) * 40.0
    assert np.median(np.abs(difference - slope[1:-1])) < 0.02 * np.abs(slope).max()


def test_the_prior_of_max_ent_functions_is_the_cubic_spline() -> None:
    """Eq. 89: 2/3 at its node, 1/6 at half its support, steepest there; d = 2 h."""
    found = functions("maxent")
    k = middle(found)
    r = np.abs(found.position_initial.values[:, 0] - 0.5) / 0.25
    inner, outer = 2 / 3 - 4 * r**2 + 4 * r**3, 4 / 3 - 4 * r + 4 * r**2 - 4 / 3 * r**3
    exact = np.where(r <= 0.5, inner, np.where(r <= 1.0, outer, 0.0))
    assert found.prior.values[:, k] == pytest.approx(exact, abs=1e-14)
    slope = np.where(r <= 0.5, -8 * r + 12 * r**2, np.where(r <= 1.0, -4 * (1 - r) ** 2, 0.0))
    side = np.sign(found.position_initial.values[:, 0] - 0.5)
    assert found.prior_gradient.values[:, k, 0] == pytest.approx(side * slope / 0.25, abs=1e-12)
    assert found.shape_function.values[:, k] == pytest.approx(exact, abs=1e-10)  # a B-spline
    assert "prior" not in functions("bspline")


def test_without_locality_a_pentagon_is_symmetric() -> None:
    """A vertex has its own value there, next to 0 on the edges that it is not on, and 1/5 in the middle."""
    plane = {"problem__dimension": 2, "problem__arrangement": "pentagon", "basis__gamma": 1e-6}
    found = functions("lme", basis__search="all", **plane)
    x, phi = found.position_initial.values, found.shape_function.values
    nodes = found.shown_nodes.values
    assert phi.shape[1] == 5 and float(found.error_partition_of_unity) < 1e-12
    centre = np.linalg.norm(x - 0.5, axis=1).argmin()
    assert phi[centre] == pytest.approx(0.2, abs=0.02)
    for k in range(5):
        near = np.linalg.norm(x - nodes[k], axis=1).argmin()
        assert phi[near, k] > 0.9 and phi[near].argmax() == k
    mirrored = np.column_stack([1.0 - x[:, 0], x[:, 1]])
    same = np.linalg.norm(x[:, None] - mirrored, axis=2).argmin(axis=1)
    assert phi[same, 0] == pytest.approx(phi[:, 0], abs=1e-8)


def test_data_at_scattered_nodes_are_met_the_better_the_more_local() -> None:
    plane = {"problem__dimension": 2, "problem__arrangement": "scattered", "resolution": 6}
    wide, narrow = (
        functions("lme", basis__search="all", basis__gamma=gamma, **plane) for gamma in (1e-6, 4.0)
    )
    assert float(wide.error_data) > 0.45 > 0.2 > float(narrow.error_data)  # the data's RMS is 0.5
    assert wide.shape_function.shape[1] == 1 and len(wide.nodal_data) == 49


def test_what_does_not_go_is_refused() -> None:
    with pytest.raises(BadSetting, match=r"problem\.arrangement"):
        read(compose("shape_functions", "evaluate", "lme", problem__arrangement="pentagon"))
    with pytest.raises(NotApplicable, match="needs method=evaluate"):
        read(compose("shape_functions", "mpm", "linear"))
