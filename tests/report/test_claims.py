"""Verdicts follow from the stored runs, and change with them."""

import pytest

from mpmbench.report.claims import (
    FAILS,
    HOLDS,
    OPEN,
    STATED,
    UNDECIDED,
    Claim,
    SetUp,
    claims_table,
    judge,
    set_ups_table,
)
from mpmbench.report.evidence import Runs
from mpmbench.results.records import read_campaign

ERROR = "error_displacement_rms"


def more_accurate(runs):
    otm, mpm = (
        runs.number("fig6", ERROR, method=method, basis="linear", resolution=32)
        for method in ("otm", "mpm")
    )
    return (HOLDS if otm < 0.5 * mpm else FAILS), f"{otm:.3g} m against {mpm:.3g} m"


def second_order(runs):
    found = runs.order("fig6", ERROR, method="mpm", basis="linear")
    return (HOLDS if found.low <= 2.0 <= found.high else FAILS), found.verdict


ACCURATE = Claim("accurate", "OTM is at least twice as accurate as MPM", "8.1", more_accurate)
ORDER = Claim("order", "MPM converges with order 2", "Fig. 6", second_order)


@pytest.fixture
def campaign(tmp_path, write_run):
    for resolution in (8, 16, 32, 64):
        write_run(tmp_path, "mpm", resolution=resolution, constant=7e-4)
        write_run(tmp_path, "otm", resolution=resolution, constant=1.6e-4)
    return tmp_path


def test_verdict_states_numbers_and_files(campaign):
    verdict = judge(ACCURATE, {"fig6": read_campaign(campaign)})
    assert verdict.answer == HOLDS
    assert verdict.because == "1.57e-07 m against 6.84e-07 m"
    assert [piece.files[0].split("-n")[0] for piece in verdict.evidence] == [
        *("otm-linear-bar_fixed_ends", "mpm-linear-bar_fixed_ends")
    ]


def test_a_doctored_run_changes_the_verdicts(campaign, write_run):
    write_run(campaign, "otm", resolution=32, constant=9e-4)
    assert judge(ACCURATE, {"fig6": read_campaign(campaign)}).answer == FAILS
    assert judge(ORDER, {"fig6": read_campaign(campaign)}).answer == HOLDS
    for resolution in (8, 16, 32, 64):
        write_run(campaign, "mpm", resolution=resolution, order=1.0)
    assert judge(ORDER, {"fig6": read_campaign(campaign)}).answer == FAILS


def test_failed_or_missing_runs_leave_a_claim_undecided_and_say_why(campaign, write_run):
    write_run(
        campaign, "otm", resolution=32, status="diverged", reason="boom", scalars={ERROR: 1e-12}
    )
    verdict = judge(ACCURATE, {"fig6": read_campaign(campaign)})
    assert verdict.answer == UNDECIDED
    assert (
        "method otm, basis linear, resolution 32" in verdict.because
        and "diverged" in verdict.because
    )
    assert judge(ACCURATE, {}).because == "there is no campaign fig6"


def test_an_ambiguous_question_is_an_error_of_the_rule(campaign, write_run):
    write_run(campaign, "otm", resolution=32, mass="consistent")
    runs = Runs({"fig6": read_campaign(campaign)})
    with pytest.raises(ValueError, match=r"differ in method\.mass"):
        runs.number("fig6", ERROR, method="otm", resolution=32)
    assert runs.number("fig6", ERROR, method="otm", resolution=32, method__mass="lumped") > 0
    assert runs.status("fig6", method="otm", resolution=32, method__mass="lumped") == "ok"


def test_table_links_every_verdict_to_its_runs(campaign):
    table = claims_table("claims", [ACCURATE, ORDER], {"fig6": read_campaign(campaign)})
    assert [row[2].value for row in table.rows] == [HOLDS, HOLDS]
    assert [len(row[2].files) for row in table.rows] == [2, 4]
    assert (
        "order of error_displacement_rms, method mpm, basis linear: 2.0" in table.rows[1][6].value
    )


@pytest.mark.parametrize(
    ("holds", "answer"),
    [
        (lambda error: error < 1.0, HOLDS),
        (lambda error: error > 1.0, FAILS),
        (lambda error: error < 1.0 and "when it is small", "holds in part: when it is small"),
        (lambda error: error > 1.0 and "when it is large", FAILS),
        (
            lambda error: {"bar": error < 1.0, "plate": error > 1.0},
            "holds in part: for bar; not for plate",
        ),
        (lambda error: {"bar": error < 1.0, "plate": error < 2.0}, HOLDS),
        (lambda error: {"bar": error > 1.0}, FAILS),
    ],
)
def test_a_measure_a_threshold_and_a_sentence_make_a_verdict(tmp_path, write_run, holds, answer):
    write_run(tmp_path, resolution=8, constant=0.064, floor=0.0)
    sentence = "the error is {error:.1e} m"

    def measure(runs):
        return {"error": runs.number("bar", "error_displacement_rms", resolution=8)}

    claim = Claim("one", "It is small", "Fig. 1", measure=measure, holds=holds, sentence=sentence)
    verdict = judge(claim, {"bar": read_campaign(tmp_path)})
    assert (verdict.answer, verdict.because) == (answer, "the error is 1.0e-03 m")
    assert len(verdict.evidence) == 1
    assert judge(claim, {}).answer == UNDECIDED


@pytest.mark.parametrize(
    "parts",
    [
        {},
        {"measure": lambda runs: {}},
        {"measure": lambda runs: {}, "holds": lambda: True},
        {"rule": lambda runs: (HOLDS, ""), "sentence": "so"},
    ],
)
def test_a_claim_has_one_thing_that_judges_it(parts):
    with pytest.raises(ValueError, match="claim one: a rule, or measure, holds and sentence"):
        Claim("one", "It is small", "Fig. 1", **parts)


LUMPED = {"mass": "lumped"}


@pytest.fixture
def masses(tmp_path, write_run):
    """Runs whose error is small with one mass only."""
    write_run(tmp_path, "otm", resolution=8, constant=0.064, floor=0.0, mass="consistent")
    write_run(tmp_path, "otm", resolution=8, constant=6.4, floor=0.0, mass="lumped")
    return {"bar": read_campaign(tmp_path)}


def small(runs):
    mass = runs.choice("mass", "consistent")
    error = runs.number("bar", ERROR, method="otm", method__mass=mass)
    return error < 0.01, f"{error:.1e} m"


def indifferent(runs):
    return runs.status("bar", method="otm", method__mass="lumped") == "ok", "it ran"


SMALL = Claim("small", "It is small", "Fig. 1", small)
INDIFFERENT = Claim("runs", "It runs", "Fig. 1", indifferent)


def test_a_claim_that_turns_on_what_the_paper_leaves_open_is_not_decidable(masses):
    undisclosed = (STATED, SetUp("lumped", LUMPED, open="the mass"))
    verdict = judge(SMALL, masses, undisclosed)
    assert verdict.answer == f"{OPEN}: the paper leaves the mass open"
    assert "as stated: holds (1.0e-03 m)" in verdict.because
    assert "lumped: does not hold (1.0e-01 m)" in verdict.because
    assert judge(INDIFFERENT, masses, undisclosed).answer == HOLDS


def test_a_set_up_that_departs_from_the_paper_changes_no_verdict(masses):
    assert judge(SMALL, masses, (STATED, SetUp("lumped", LUMPED))).answer == HOLDS


def test_table_of_set_ups_says_which_satisfies_all(masses):
    lumped = SetUp("lumped", LUMPED, open="the mass")
    table = set_ups_table("set-ups", [SMALL, INDIFFERENT], masses, (STATED, lumped))
    assert [[cell.text for cell in row[1:]] for row in table.rows] == [
        ["yes", "no"],
        ["yes", "yes"],
        ["2", "1"],
    ]
    assert "All claims hold in: as stated." in table.note
    assert "The paper leaves open: the mass." in table.note
    table = set_ups_table("set-ups", [SMALL], masses, (lumped, SetUp("third", {"mass": "none"})))
    assert [cell.text for cell in table.rows[0][1:]] == ["no", ""]
    assert table.rows[-1][0].text == "not judged"
    assert [cell.text for cell in table.rows[-1][1:]] == ["0", "1"]
    assert "No set-up satisfies all 1 claims" in table.note
    assert "Empty cells: It is small: bar: no run with method otm" in table.note


def test_a_table_of_one_set_up_is_left_out_and_one_of_many_refused(masses):
    assert not set_ups_table("set-ups", [SMALL], masses, (STATED,))
    many = tuple(SetUp(str(k)) for k in range(9))
    with pytest.raises(ValueError, match="9 set-ups"):
        set_ups_table("set-ups", [SMALL], masses, many)


def told(name, key, wanted):
    """A claim that holds where a choice has the wanted value."""

    def rule(runs):
        return runs.choice(key, "stated") == wanted, f"{key} is {runs.choice(key, 'stated')}"

    return Claim(name, f"It holds with {key} {wanted}", "Fig. 1", rule)


MASS, SIZE = SetUp("lumped", {"mass": "lumped"}), SetUp("wide", {"size": "wide"})
OTHER_MASS = SetUp("none", {"mass": "none"})


def test_the_best_combination_is_a_set_up_of_its_own():
    claims = [told("a", "mass", "lumped"), told("b", "size", "wide"), told("c", "load", "stated")]
    table = set_ups_table("set-ups", claims, {}, (STATED, MASS, OTHER_MASS, SIZE))
    assert table.columns[-1] == "best: lumped and wide"
    assert [row[-1].text for row in table.rows] == ["yes", "yes", "yes", "3"]
    assert "All claims hold in: best: lumped and wide." in table.note


def test_a_combination_that_satisfies_no_more_is_left_out():
    claims = [told("a", "mass", "lumped"), told("b", "size", "stated")]
    table = set_ups_table("set-ups", claims, {}, (STATED, MASS, SIZE))
    assert table.columns == ["claim", "as stated", "lumped", "wide"]
    assert [cell.text for cell in table.rows[-1][1:]] == ["1", "2", "0"]
    claims += [told("c", "load", "end"), told("d", "size", "wide")]
    table = set_ups_table(
        "set-ups", claims, {}, (STATED, MASS, SIZE)
    )  # both: a and d, lumped: a and b
    assert table.columns == ["claim", "as stated", "lumped", "wide"]
    assert "No combination of these set-ups satisfies more." in table.note


def test_two_values_of_one_choice_are_not_combined():
    claims = [told("a", "mass", "lumped"), told("b", "mass", "none"), told("c", "mass", "x")]
    table = set_ups_table("set-ups", claims, {}, (STATED, MASS, OTHER_MASS))
    assert len(table.columns) == 4


def test_with_a_best_combination_a_table_has_no_more_than_eight_set_ups():
    claims = [told("a", "mass", "lumped"), told("b", "size", "wide")]
    more = tuple(SetUp(str(k), {str(k): k}) for k in range(4))
    for rest, columns in ((more, 9), ((*more, SetUp("last", {"last": 1})), 9)):
        table = set_ups_table("set-ups", claims, {}, (STATED, MASS, SIZE, *rest))
        assert len(table.columns) == columns
