"""Every registered material: stress against the derivative of its energy, objectivity, and small-strain limit."""

import pytest

from mpmbench.contracts import materials
from mpmbench.core import registry
from mpmbench.core.errors import BadSetting
from tests.support import slow_if

CASES = [
    (check, case)
    for name in registry.names("material")
    for case in materials.cases(name)
    for check in materials.CHECKS.of(case)
]


def name_of(part: object) -> str:
    return (
        f"{part.name}-{part.dimension}D" if isinstance(part, materials.MaterialCase) else str(part)
    )


@pytest.mark.parametrize(
    ("check", "case"),
    # each dimension is compiled anew from the same text: that of the plane here, with a direction out of it
    [slow_if(case.dimension != 2, check, case) for check, case in CASES],
    ids=name_of,
)
def test_contract(check: str, case: materials.MaterialCase) -> None:
    finding = materials.CHECKS[check](case)
    assert finding.passed, finding.text


@pytest.mark.parametrize(
    ("key", "value"),
    [("young_modulus", 0.0), ("young_modulus", -1.0), ("poisson_ratio", 0.5), ("density", 0.0)],
)
def test_constants_out_of_range_are_refused(key: str, value: float) -> None:
    with pytest.raises(BadSetting, match=key):
        registry.get("material", "neo_hookean")(**{key: value})
