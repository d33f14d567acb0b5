"""Runs for the solver's tests: a configuration put together from the YAML files, without the command line."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import yaml

from mpmbench.analysis.convergence import fitted_order
from mpmbench.case import solve

CONF = Path(__file__).parents[2] / "conf"
EXTRA = {"cfl": 0.5, "threads": 1, "seed": 0}


def options(group: str) -> list[str]:
    """Names of the options of a configuration group."""
    return sorted(file.stem for file in (CONF / group).glob("*.yaml"))


def load(group: str, name: str) -> dict[str, Any]:
    return yaml.safe_load((CONF / group / f"{name}.yaml").read_text())


def section(group: str, name: str) -> dict[str, Any]:
    """The settings of one option: below its group's name, or the whole file."""
    content = load(group, name)
    content = content.get(group, content)
    return {key: value for key, value in content.items() if key != "defaults"}


def compose(problem: str, method: str, basis: str, **changes: Any) -> dict[str, Any]:
    """A resolved configuration; `changes` are keys such as ``resolution=16`` or ``method__mass="lumped"``."""
    defaults = load("problem", problem)
    settings = {**defaults["problem"]}
    material_defaults = settings.pop("material_defaults", {})
    method_defaults = settings.pop("method_defaults", {}).get(method, {})
    basis_defaults = settings.pop("basis_defaults", {}).get(basis, {})
    material = changes.pop("material", None) or next(
        entry["override /material"]
        for entry in defaults["defaults"]
        if "override /material" in entry
    )
    config: dict[str, Any] = {
        **EXTRA,
        **{k: v for k, v in defaults.items() if k not in ("defaults", "problem")},
        "problem": settings,
        "method": {**section("method", method), **method_defaults},
        "basis": {**section("basis", basis), **basis_defaults},
        "material": section("material", material),
    }
    config["material"].update(
        {k: v for k, v in material_defaults.items() if k in config["material"]}
    )
    for key, value in changes.items():
        target = config
        *groups, last = key.split("__")
        for group in groups:
            target = target[group]
        target[last] = value
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
