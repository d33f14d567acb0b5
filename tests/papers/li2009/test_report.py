"""The report: chapters and claims wait for missing runs, and ask for experiments that exist; verdicts follow rules."""

import re
from pathlib import Path
from typing import Any

import pytest

from mpmbench.papers import find
from mpmbench.papers.kit import Campaigns
from mpmbench.papers.li2009 import claims
from mpmbench.papers.li2009.bar import BARS
from mpmbench.report.claims import FAILS, HOLDS, UNDECIDED, judge
from mpmbench.report.evidence import MissingRuns
from mpmbench.settings.schema import experiments
from tests.papers.told import answer

PAPER = find("li2009")


@pytest.mark.parametrize("chapter", PAPER.chapters)
def test_chapters_wait_for_their_runs(chapter) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(MissingRuns):
        chapter(Campaigns())


@pytest.mark.parametrize("claim", PAPER.claims)
def test_claims_are_undecided_without_runs(claim) -> None:  # type: ignore[no-untyped-def]
    assert judge(claim, Campaigns()).answer == UNDECIDED


def test_campaigns_are_experiments() -> None:
    """Whatever the chapters and claims ask for is run by an experiment, and every experiment is asked for."""
    folder = Path(__file__).parents[3] / "mpmbench" / "papers" / "li2009"
    text = "".join(file.read_text() for file in folder.glob("*.py"))
    names = {name.removeprefix("li2009/") for name in experiments() if name.startswith("li2009/")}
    assert names == {name for name in names if re.search(f'"{name}"', text)}
    asked = set(
        re.findall(r'campaigns\["(\w+)"\]|campaigns, "(\w+)"|runs\.(?!choice)\w+\(\s*"(\w+)"', text)
    )
    assert {name for group in asked for name in group if name} <= names


@pytest.mark.parametrize(
    ("limit", "verdict"),
    [(0.0, HOLDS), (2.0, "holds in part: when gamma is 2.4 or more"), (10.0, FAILS)],
    ids=str,
)
def test_verdict_on_the_tensile_instability(limit: float, verdict: str) -> None:
    """Of a map that is unstable for gamma below the limit from a stretch of 1.5."""

    def growth(campaign: str, quantity: str, match: dict[str, Any]) -> float:
        return 1e9 if match["basis__gamma"] < limit and match["problem__stretch"] >= 1.5 else 1.0

    assert answer("li2009", "tensile_instability", growth) == verdict


@pytest.mark.parametrize(
    ("bad", "verdict"),
    [
        ("", HOLDS),
        (
            "OTM, lumped, 1 particle per cell",
            "holds in part: when there are two particles per cell",
        ),
        ("OTM, consistent mass", FAILS),
    ],
)
@pytest.mark.parametrize(
    ("quantity", "value"),
    [
        ("tip_displacement_error", 0.04),
        ("tip_displacement_max", 1.04 * claims.AMPLITUDE),
        ("tip_displacement_min", -1.07 * claims.AMPLITUDE),
        ("tip_velocity_max", 7.1),
    ],
)
def test_verdict_on_the_bar(bad: str, verdict: str, quantity: str, value: float) -> None:
    good = {
        "tip_displacement_error": 0.02,
        "tip_displacement_max": 1.01 * claims.AMPLITUDE,
        "tip_displacement_min": -1.02 * claims.AMPLITUDE,
        "tip_velocity_max": 6.5,
    }

    def number(campaign: str, asked: str, match: dict[str, Any]) -> float:
        return value if asked == quantity and bad and match == BARS[bad] else good[asked]

    assert answer("li2009", "bar", number) == verdict
