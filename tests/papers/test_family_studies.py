"""The claims of the three studies: each verdict follows from the numbers, whichever they are."""

from typing import Any

from mpmbench.papers.family_studies import PAPER
from mpmbench.papers.family_studies.support import INNER, WAVES
from mpmbench.report.claims import FAILS, HOLDS, PARTLY
from tests.papers import told

CLAIMS = {one.name: one for one in PAPER.claims}
Given = tuple[str, dict[str, Any], Any]


def answer(name: str, *given: Given) -> str:
    """The verdict where each number is the one `given` whose settings fit best, the first one of equals."""

    def tell(campaign: str, quantity: str, match: dict[str, Any]) -> float | str:
        fits = [
            (len(settings), value)
            for known, settings, value in given
            if known == quantity and settings.items() <= match.items()
        ]
        if not fits:
            return "ok" if quantity == "status" else "there is none"
        return max(fits, key=lambda one: one[0])[1]

    return told.answer("family_studies", name, tell)


def test_crossing_noise() -> None:
    crossings = ("n_cell_crossings", {}, 40.0)
    noisy = (INNER, {"basis": "linear"}, 1.0)
    falls = [(INNER, {"resolution": n}, 1.0 / n) for n in (64, 128, 256)]
    hats = [(INNER, {"basis": "linear", "resolution": n}, 1.0) for n in (64, 128, 256)]
    assert answer("crossing_noise", crossings, noisy, *hats, *falls) == HOLDS
    level = [(INNER, {"basis": "ddmp", "resolution": n}, 0.1) for n in (64, 128, 256)]
    assert answer("crossing_noise", crossings, *level, *hats, *falls).startswith(PARTLY)
    as_bad = [(INNER, {"resolution": n}, 1.0) for n in (64, 128, 256)]
    assert answer("crossing_noise", crossings, *as_bad) == FAILS


def test_kernels() -> None:
    rate = "growth_rate_predicted"
    kept, anew = ({"method__shape_functions": kind} for kind in ("frozen", "updated"))
    assert answer("kernels", (rate, kept, 0.0), (rate, anew, 0.5)) == HOLDS
    assert answer("kernels", (rate, kept, 0.1), (rate, anew, 0.5)).startswith(PARTLY)
    assert answer("kernels", (rate, kept, 0.1), (rate, anew, 0.0)) == FAILS


def test_agreement() -> None:
    stable = [("growth_rate_predicted", {}, 0.0), ("growth", {}, 1.0)]
    lme = WAVES["LME, Eulerian"] | {"problem__stretch": 2.0}
    grows = [("growth_rate_predicted", lme, 1.0), ("growth_rate", lme, 1.05)]
    assert answer("agreement", *stable, *grows) == HOLDS
    assert answer("agreement", *stable, grows[0], ("growth_rate", lme, 1.2)).startswith(PARTLY)
    other = WAVES["LME, Eulerian"] | {"problem__stretch": 1.5}
    silent = ("growth_rate_predicted", other, 1.0)
    assert answer("agreement", *stable, *grows, silent).startswith(PARTLY)
    seen_only = ("growth_rate", other, 1.0)
    assert answer("agreement", *stable, *grows, seen_only).startswith(PARTLY)


def test_spurious_modes() -> None:
    wave, nodal = "shortest_wave", {"problem__particle_layout": "nodes"}
    scni = nodal | {"method__gradient": "conforming"}
    assert answer("spurious_modes", (wave, {}, 0.5), (wave, nodal, 0.0), (wave, scni, 0.4)) == HOLDS
    assert answer("spurious_modes", (wave, {}, 0.5), (wave, nodal, 0.0)).startswith(PARTLY)


def test_cantilever() -> None:
    late, updated = "late_maximum", ("late_maximum", {"method": "mpm"}, -0.9)
    assert answer("cantilever", (late, {}, 0.05), updated) == HOLDS
    assert answer("cantilever", (late, {}, 0.05)).startswith(PARTLY)
    assert answer("cantilever", (late, {}, 0.2), (late, {"method": "mpm"}, 0.04)) == FAILS
    broke = ("status", {"method": "mpm"}, "broke_down")
    assert answer("cantilever", (late, {}, 0.05), broke) == HOLDS


def test_every_claim_is_judged_here() -> None:
    assert set(CLAIMS) == {"crossing_noise", "kernels", "agreement", "spurious_modes", "cantilever"}
