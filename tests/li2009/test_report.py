"""The report: chapters and claims wait for missing runs, and ask for experiments that exist."""

import re
from pathlib import Path

import pytest

from mpmbench.report.claims import UNDECIDED, MissingRuns, judge
from mpmbench.report.papers import find
from mpmbench.report.papers.parts import Campaigns
from mpmbench.runs.schema import experiments

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
    folder = Path(__file__).parents[2] / "mpmbench" / "report" / "papers" / "li2009"
    text = "".join(file.read_text() for file in folder.glob("*.py"))
    names = {name.removeprefix("li2009/") for name in experiments() if name.startswith("li2009/")}
    assert names == {name for name in names if re.search(f'"{name}"', text)}
    asked = set(re.findall(r'campaigns\["(\w+)"\]|campaigns, "(\w+)"|runs\.\w+\(\s*"(\w+)"', text))
    assert {name for group in asked for name in group if name} <= names
