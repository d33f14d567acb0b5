"""Runs for the solver's tests: resolved configurations without the command line and Hydra."""

from typing import Any

import numpy as np
import xarray as xr

from mpmbench.analysis.slopes import fitted_order
from mpmbench.case import solve
from mpmbench.settings.files import read_yaml, shipped_folder
from mpmbench.settings.resolve import fill
from mpmbench.settings.schema import GROUPS, composed


def compose(problem: str, method: str, basis: str, **changes: Any) -> dict[str, Any]:
    """A resolved configuration; `changes` are keys such as ``resolution=16`` or ``method__mass="lumped"``."""
    body = composed("problem", problem)
    chosen = {"problem": problem, "method": method, "basis": basis}
    chosen["contact"] = changes.pop("contact", "shared")
    chosen["material"] = changes.pop("material", None) or next(
        entry["override /material"] for entry in body["defaults"] if "override /material" in entry
    )
    top = {**read_yaml(shipped_folder("conf") / "config.yaml"), **body}
    plain = {key: value for key, value in top.items() if key not in ("defaults", "hydra", *GROUPS)}
    plain |= {group: dict(composed(group, chosen[group])[group]) for group in GROUPS}
    given = {key.replace("__", "."): value for key, value in changes.items()}
    for key, value in given.items():
        group, _, name = key.rpartition(".")
        (plain[group] if group else plain)[name] = value
    config, reason = fill(plain, set(given), None)
    assert not reason, reason
    return config


def run(problem: str, method: str, basis: str, **changes: Any) -> xr.Dataset:
    """Solve one composed case and expect it to end well."""
    result = solve(compose(problem, method, basis, **changes))
    assert result.attrs["status"] == "ok", result.attrs["reason"]
    return result


class ConvergenceStudy:
    """Order of an error norm over the resolutions `cells`; a subclass states what is expected."""

    problem = "bar_fixed_ends"
    method = "mpm"
    basis = "linear"
    changes: dict[str, Any] = {}
    norm = "error_displacement_rms"
    cells: tuple[int, ...] = (8, 16, 32)
    order = 2.0
    tolerance = 0.15

    def test_order(self) -> None:
        errors = [
            float(
                run(self.problem, self.method, self.basis, resolution=n, **self.changes)[self.norm]
            )
            for n in self.cells
        ]
        order = fitted_order(1.0 / np.array(self.cells), np.array(errors))
        assert abs(order - self.order) <= self.tolerance, (order, errors)
