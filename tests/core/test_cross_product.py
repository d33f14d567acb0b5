"""Every method with every basis on every problem: a cell runs, or it says why it does not."""

from typing import Any

import pytest

from mpmbench import case
from mpmbench.core import registry
from mpmbench.core.errors import BadSetting, NotApplicable
from mpmbench.runs.hydra import compose
from mpmbench.settings import schema

SMALL = {1: 12, 2: 4, 3: 3}  # cells along the reference length
EVERY = [
    (p, m, b)
    for p in schema.options("problem")
    for m in schema.options("method")
    for b in schema.options("basis")
]


def configuration(problem: str, method: str, basis: str) -> dict[str, Any]:
    (config, reason), *_ = compose.compose_many(
        [[f"problem={problem}", f"method={method}", f"basis={basis}"]]
    )
    if reason:
        raise NotApplicable(reason)
    dimension = registry.get("problem", problem)().dimension
    config = {**config, "resolution": min(int(config["resolution"]), SMALL[dimension])}
    if config["time_step"] != "auto":
        config["end_time"] = min(float(config["end_time"]), 3.0 * float(config["time_step"]))
    return config


def attempt(problem: str, method: str, basis: str) -> str:
    """Status of a few steps on a coarse grid, or why the cell does not apply."""
    try:
        config = configuration(problem, method, basis)
        case.read(config)
    except (NotApplicable, BadSetting) as reason:
        return f"not applicable: {reason}"
    result = case.solve(config)
    return f"{result.attrs['status']}: {result.attrs['reason']}"


QUICK = [
    cell
    for cell in EVERY
    if cell[0] == "plate_axis_aligned" and cell[1] in ("mpm", "otm", "unified")
]


@pytest.mark.parametrize(("problem", "method", "basis"), QUICK)
def test_cells_of_the_explicit_benchmarks(problem: str, method: str, basis: str) -> None:
    outcome = attempt(problem, method, basis)
    promises = registry.get("basis", basis).promises
    # no Galerkin method can do without the first, nor one of moving nodes without the second
    applies = promises.partition_of_unity and (promises.moves or method == "mpm")
    assert outcome == "ok: " if applies else outcome.startswith("not applicable: "), outcome


@pytest.mark.parametrize(
    ("problem", "method", "basis", "reason"),
    (
        ("bar_fixed_ends", "sph", "sph_kernel", "has no nodes of its own"),
        ("elastic_bar_tension", "sph", "sph_kernel", "set problem.particle_layout=nodes"),
        ("cantilever_dynamic", "unified", "bspline", "keeps lines along the axes straight"),
    ),
)
def test_what_cannot_start_is_refused(problem: str, method: str, basis: str, reason: str) -> None:
    assert reason in attempt(problem, method, basis)


@pytest.mark.slow
def test_every_cell_is_accepted_or_refused_with_a_reason() -> None:
    overrides = [[f"problem={p}", f"method={m}", f"basis={b}"] for p, m, b in EVERY]
    for cell, (config, reason) in zip(EVERY, compose.compose_many(overrides), strict=True):
        if reason:
            continue
        try:
            case.read(config)
        except (NotApplicable, BadSetting) as refusal:
            assert len(str(refusal)) > 20, cell


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "method", "basis"), [cell for cell in EVERY if cell not in QUICK]
)
def test_cells_of_the_other_problems(problem: str, method: str, basis: str) -> None:
    """Here a cell may also break down or not converge: then its reason is the result."""
    outcome = attempt(problem, method, basis)
    status, _, reason = outcome.partition(": ")
    assert status in ("ok", "not applicable", "broke_down", "not_converged", "diverged"), outcome
    assert status == "ok" or len(reason) > 10
