"""The claims on the family: each verdict follows from the numbers, whichever they are."""

from typing import Any

import pytest

from mpmbench.papers.family import PAPER
from mpmbench.papers.family.support import CELLS
from mpmbench.report.claims import FAILS, HOLDS, PARTLY
from mpmbench.settings.schema import experiments
from tests.papers import told

CLAIMS = {one.name: one for one in PAPER.claims}


def answer(name: str, *given: tuple[str, dict[str, Any], Any]) -> str:
    """The verdict where each number is the one `given` whose settings fit best, the first one of equals."""
    asked = set()

    def tell(campaign: str, quantity: str, match: dict[str, Any]) -> float | str:
        asked.add(campaign)
        fits = [
            (len(settings), value)
            for known, settings, value in given
            if known == quantity and settings.items() <= match.items()
        ]
        if not fits and quantity == "status":
            return "ok"
        value = max(fits, key=lambda one: one[0])[1]
        return float(match["resolution"]) ** -value[0] if isinstance(value, tuple) else value

    found = told.answer("family", name, tell)
    assert asked <= {
        one.removeprefix("family/") for one in experiments() if one.startswith("family/")
    }  # what a claim asks for is run
    return found


def stress(basis: str, n: int, value: float) -> tuple[str, dict[str, Any], float]:
    return "error_stress_rms", {"basis": basis, "resolution": n}, value


def test_crossing() -> None:
    crossings = ("n_cell_crossings", {}, 5)
    hats = [stress("linear", n, 10.0) for n in (64, 128, 256)]
    falls = [stress("gimp", n, 100.0 / n) for n in (64, 128, 256)]
    level = [stress("gimp", n, 1.0) for n in (64, 128, 256)]
    assert answer("gimp_crossing", crossings, *hats, *falls) == HOLDS
    assert answer("gimp_crossing", crossings, *hats, *level).startswith(PARTLY)
    assert answer("gimp_crossing", crossings, *hats, *[(a, b, 9.0) for a, b, _ in level]) == FAILS


def test_fracture() -> None:
    holds = [("largest_gap", {}, 1.1), ("error_elongation", {}, 0.01)]
    parted = [("status", {"basis": "gimp"}, "broke_down")]
    assert answer("cpdi_fracture", *holds, *parted) == HOLDS
    assert answer("cpdi_fracture", *holds).startswith(PARTLY)
    assert answer("cpdi_fracture", *holds, ("status", {"basis": "cpdi"}, "broke_down")) == FAILS
    for wrong in (
        ("largest_gap", {"basis": "cpdi"}, 2.5),
        ("error_elongation", {"basis": "cpdi"}, 0.03),
    ):
        assert answer("cpdi_fracture", *holds[::-1], *parted, wrong).startswith(PARTLY)
    fine = ("status", {"basis": "cpdi", "resolution": 16}, "broke_down")
    assert answer("cpdi_fracture", *holds, *parted, fine).startswith(PARTLY)


def kept(
    quantity: str, transfer: str, terms: int, value: float
) -> tuple[str, dict[str, Any], float]:
    settings = {"method__transfer": transfer, "method__transfer_order": terms}
    return quantity, settings if terms else {"method__transfer": transfer}, value


def test_angular_momentum() -> None:
    quantity = "angular_momentum_kept"
    pic, cut = kept(quantity, "pic", 0, 0.1), kept(quantity, "apic", 0, 0.999)
    for loss, verdict in ((1e-13, HOLDS), (1e-6, FAILS)):
        apic = (quantity, {"method__transfer": "apic", "method__mass_cutoff": 0.0}, 1.0 - loss)
        assert answer("apic_momentum", pic, cut, apic) == verdict
    exact = (quantity, {"method__transfer": "apic", "method__mass_cutoff": 0.0}, 1.0)
    assert answer("apic_momentum", kept(quantity, "pic", 0, 0.999), cut, exact) == FAILS


@pytest.mark.parametrize(("name", "terms"), [("xpic", (2, 5)), ("fmpm", (2, 3, 5))])
def test_dissipation(name: str, terms: tuple[int, ...]) -> None:
    quantity, claim = "kinetic_energy_kept", f"{name}_dissipation"
    pic = kept(quantity, "pic", 0, 0.25)
    better = [kept(quantity, name, k, 1.0 - 0.2 / k) for k in terms]
    worse = [kept(quantity, name, k, 0.4 - 0.01 * k) for k in terms]
    assert answer(claim, pic, *better) == HOLDS
    assert answer(claim, pic, *worse) == FAILS
    settings = {"method__transfer": name, "method__transfer_order": terms[-1]}
    broke = ("status", settings, "broke_down")
    assert answer(claim, pic, *better, broke).startswith(PARTLY)


def test_fmpm_against_xpic() -> None:
    low, high = (
        kept("kinetic_energy_kept", name, 2, x) for name, x in (("fmpm", 0.3), ("xpic", 0.6))
    )
    assert answer("fmpm_against_xpic", low, high) == FAILS
    high = kept("kinetic_energy_kept", "xpic", 2, 0.2)
    assert answer("fmpm_against_xpic", low, high) == HOLDS


def test_total_lagrangian() -> None:
    steps, slow = ("steps", {}, 100), ("solver_cpu_time", {"method": "mpm"}, 2.0)
    assert answer("tlmpm_cost", steps, slow, ("solver_cpu_time", {"method": "tlmpm"}, 1.0)) == HOLDS
    assert answer("tlmpm_cost", steps, slow, ("solver_cpu_time", {"method": "tlmpm"}, 1.9)) == FAILS
    error = "error_displacement_rms"
    assert answer("tlmpm_order", (error, {}, (2.0,))) == HOLDS  # of an order: h^2
    assert answer("tlmpm_order", (error, {}, (1.0,))) == FAILS
    hats = (error, {"basis": "linear"}, (0.5,))
    assert answer("tlmpm_order", (error, {}, (2.0,)), hats).startswith(PARTLY)
    best = [(error, {}, 1.0), (error, {"method": "tlmpm"}, 0.5)]
    assert answer("tlmpm_best", *best) == HOLDS
    other = (error, {"basis": "cpdi", "problem__seeding": "polar"}, 0.1)
    assert answer("tlmpm_best", *best, other).startswith(PARTLY)


def test_survival_on_the_vortex() -> None:
    falls = [("error_displacement_rms", {"resolution": n}, 1.0 / n) for n in CELLS]
    broke = [("status", {"basis": basis}, "broke_down") for basis in ("linear", "gimp")]
    assert answer("vortex_survival", *falls, *broke) == HOLDS
    assert answer("vortex_survival", *falls).startswith(PARTLY)


def test_locking() -> None:
    share = "middle_over_reference"
    free = (share, {"method__volumetric": "f_bar"}, 1.01)
    locked = (share, {"method__volumetric": "standard"}, 0.5)
    assert answer("f_bar_locking", free, locked) == HOLDS
    splines = (share, {"method__volumetric": "standard", "basis": "bspline"}, 0.95)
    assert answer("f_bar_locking", free, locked, splines) == HOLDS  # they do not lock
    assert answer("f_bar_locking", free, (share, {"method__volumetric": "standard"}, 0.95)) == FAILS
    wrong = (share, {"method__volumetric": "f_bar", "method": "fem"}, 1.2)
    assert answer("f_bar_locking", free, wrong, locked).startswith(PARTLY)


def test_every_claim_is_judged_here() -> None:
    judged = {
        "gimp_crossing", "cpdi_fracture", "apic_momentum", "xpic_dissipation", "fmpm_dissipation",
        "fmpm_against_xpic", "tlmpm_cost", "tlmpm_order", "tlmpm_best", "vortex_survival", "f_bar_locking",
    }  # fmt: skip
    assert set(CLAIMS) == judged
