"""Every claim of the shipped papers is a sentence of its paper with a stated threshold."""

from pathlib import Path

import pytest

import mpmbench
from mpmbench.papers import Campaigns, find
from mpmbench.report.claims import MOST_SET_UPS, UNDECIDED, judge
from mpmbench.settings.schema import experiments

PAPERS = ("wobbes2020", "li2009", "iaconeta2017")


@pytest.mark.parametrize("name", PAPERS)
def test_claims_quote_their_paper_and_state_a_threshold(name):
    claims = find(name).claims
    assert len({claim.name for claim in claims}) == len(claims)
    for claim in claims:
        assert len(claim.quote.split()) >= 4, claim.name
        assert claim.threshold and claim.source, claim.name


@pytest.mark.parametrize("name", PAPERS)
def test_a_paper_has_one_stated_set_up_and_few_others(name):
    paper = find(name)
    stated, *others = paper.set_ups
    assert paper.stated and not stated.choices and not stated.open
    assert 1 <= len(others) < MOST_SET_UPS
    assert all(set_up.choices for set_up in others)
    assert any(set_up.open for set_up in others)


@pytest.mark.parametrize("name", (*PAPERS, "family", "family_studies"))
def test_without_runs_nothing_is_decided(name):
    paper = find(name)
    for claim in paper.claims:
        assert judge(claim, Campaigns(), paper.set_ups).answer == UNDECIDED, claim.name


@pytest.mark.parametrize("name", (*PAPERS, "family", "family_studies"))
def test_every_experiment_has_a_chapter(name):
    """What a paper leaves open is not only run and judged but shown."""
    rooms = (Path(mpmbench.__file__).parent / "papers" / name).glob("*.py")
    text = "".join(file.read_text() for file in rooms if file.name != "claims.py")
    own = [one.partition("/")[2] for one in experiments() if one.startswith(f"{name}/")]
    assert [one for one in own if f'"{one}"' not in text] == []
