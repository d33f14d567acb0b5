"""Claims of a paper with verdicts computed from stored runs; none is typed in by hand.

A rule asks for numbers, orders and statuses by what a run must match (`evidence.Runs`). All claims
of a paper are judged in one set-up, which the paper states, and beside it in others; where the
paper leaves a choice open and the answer turns on it, the claim cannot be decided.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

from mpmbench.report.evidence import Evidence, MissingRuns, Runs
from mpmbench.report.tables import Cell, Table
from mpmbench.results.records import Campaign

HOLDS, PARTLY, FAILS = "holds", "holds in part", "does not hold"
OPEN, UNDECIDED = "not decidable", "undecided"  # the paper leaves a choice open; runs are missing
SHORT = {HOLDS: "yes", PARTLY: "in part", FAILS: "no", OPEN: "open"}  # in cells of a table
MOST_SET_UPS = 8
Holds = bool | str | Mapping[str, bool]
Rule = Callable[[Runs], tuple[Holds, str]]


@dataclass(frozen=True)
class SetUp:
    """Choices under which all claims of a paper are judged.

    Attributes
    ----------
    name : str
        As the head of a column has it.
    choices : mapping
        What is chosen otherwise than in the stated set-up; rules ask for it by `Runs.choice`.
    open : str
        What the paper leaves open here ("the weight of the moving least squares"); empty where it
        states a choice, so that this one departs from the paper.
    """

    name: str
    choices: Mapping[str, Any] = field(default_factory=dict)
    open: str = ""


STATED = SetUp("as stated")


@dataclass(frozen=True)
class Verdict:
    """What the runs say about a claim.

    Attributes
    ----------
    answer : str
        ``holds``, ``holds in part: <where>``, ``does not hold``, ``not decidable: the paper leaves
        ... open``; ``undecided`` while runs are missing.
    because : str
        One sentence with the numbers.
    evidence : tuple of Evidence
    asked : frozenset of str
        Choices of the set-up that the rule depends on.
    """

    answer: str
    because: str
    evidence: tuple[Evidence, ...] = ()
    asked: frozenset[str] = frozenset()

    @property
    def short(self) -> str:
        """The answer without where and why."""
        return self.answer.partition(":")[0]


@dataclass(frozen=True)
class Claim:
    """A statement of a paper and what judges it: a rule, or measure, threshold and sentence.

    Attributes
    ----------
    name : str
        Short and unique, for links.
    statement, source : str
        What is judged, and where the paper says it (section, figure, table).
    rule : callable, optional
        Takes `Runs`, returns what `holds` does and a sentence with the numbers. It stands for the
        three that follow when the words depend on what is found.
    measure : callable, optional
        Takes `Runs`, returns numbers by name.
    holds : callable, optional
        Takes these numbers by name, returns whether the statement holds; where it holds in part,
        the place in words (``"with lumped mass"``), or an answer for each part by its name; ``"not
        decidable: ..."`` with what the paper leaves open.
    sentence : str
        A format of the numbers: ``"with 200 cells the error is {error:.1e} m"``.
    quote : str
        The paper's own sentence.
    threshold : str
        What the statement has to meet, in words and numbers.
    """

    name: str
    statement: str
    source: str
    rule: Rule | None = None
    measure: Callable[[Runs], Mapping[str, Any]] | None = None
    holds: Callable[..., Holds] | None = None
    sentence: str = ""
    quote: str = ""
    threshold: str = ""

    def __post_init__(self) -> None:
        """Refuse a claim that nothing judges, or two things."""
        parts = (self.measure is not None, self.holds is not None, bool(self.sentence))
        if any(parts) == (self.rule is not None) or any(parts) != all(parts):
            raise ValueError(
                f"claim {self.name}: a rule, or measure, holds and sentence are needed"
            )

    def answer(self, runs: Runs) -> tuple[str, str]:
        """The answer, and a sentence with the numbers."""
        if self.rule is not None:
            holds, because = self.rule(runs)
        else:
            assert self.measure is not None and self.holds is not None
            found = self.measure(runs)
            holds, because = self.holds(**found), self.sentence.format(**found)
        return in_words(holds), because


def in_words(holds: Holds) -> str:
    """``holds``, ``does not hold``, or ``holds in part: <where>``."""
    if isinstance(holds, Mapping):
        good = [name for name, does in holds.items() if does]
        bad = [name for name, does in holds.items() if not does]
        holds = not bad or (bool(good) and f"for {', '.join(good)}; not for {', '.join(bad)}")
    if isinstance(holds, str):
        known = (HOLDS, FAILS, OPEN)
        return holds if holds.partition(":")[0] in known else f"{PARTLY}: {holds}"
    return HOLDS if holds else FAILS


class Claims(list[Claim]):
    """Claims in the order in which their functions are written; called, it decorates one of them.

    The name of the function is that of the claim. With `holds` and `sentence` it is the `measure`
    of a `Claim`, without them the `rule`::

        @claim("OTM converges with order 2", "Fig. 3", holds=..., sentence="p = {p:.2f}")
        def order(runs: Runs) -> dict[str, float]:
    """

    def __call__(self, statement: str, source: str, **parts: Any) -> Callable[[Any], Any]:
        def add(function: Any) -> Any:
            role = "measure" if "holds" in parts or "sentence" in parts else "rule"
            self.append(Claim(function.__name__, statement, source, **{role: function}, **parts))
            return function

        return add


def judge(
    claim: Claim, campaigns: Mapping[str, Campaign], set_ups: Sequence[SetUp] = (STATED,)
) -> Verdict:
    """The verdict of a paper's first set-up, unless it turns on a choice that the paper leaves open.

    Runs that are missing or failed leave it undecided, with the reason.
    """
    stated = judge_in(claim, campaigns, set_ups[0])
    if stated.answer == UNDECIDED:
        return stated
    turned: dict[str, list[str]] = {}
    evidence = list(stated.evidence)
    for set_up in set_ups[1:]:
        if not (set_up.open and stated.asked & set(set_up.choices)):
            continue
        other = judge_in(claim, campaigns, set_up)
        if other.answer != UNDECIDED and other.short != stated.short:
            words = f"{set_up.name}: {other.answer} ({other.because})"
            turned.setdefault(set_up.open, []).append(words)
            evidence += other.evidence
    if not turned:
        return stated
    answer = f"{OPEN}: the paper leaves {' and '.join(turned)} open"
    because = f"{set_ups[0].name}: {stated.answer} ({stated.because}). " + ". ".join(
        words for group in turned.values() for words in group
    )
    return Verdict(answer, because, tuple(evidence), stated.asked)


def judge_in(claim: Claim, campaigns: Mapping[str, Campaign], set_up: SetUp) -> Verdict:
    """The verdict in one set-up."""
    runs = Runs(campaigns, choices=set_up.choices)
    try:
        answer, because = claim.answer(runs)
    except MissingRuns as missing:
        answer, because = UNDECIDED, str(missing)
    return Verdict(answer, because, tuple(runs.evidence), frozenset(runs.asked))


def claims_table(
    name: str,
    claims: Iterable[Claim],
    campaigns: Mapping[str, Campaign],
    set_ups: Sequence[SetUp] = (STATED,),
) -> Table:
    """Claims, verdicts and evidence; every row links to its runs."""
    rows = []
    for claim in claims:
        verdict = judge(claim, campaigns, set_ups)
        files = tuple(dict.fromkeys(file for piece in verdict.evidence for file in piece.files))
        numbers = "; ".join(f"{piece.name}: {Cell(piece.value).text}" for piece in verdict.evidence)
        answer = Cell(verdict.answer, files)
        threshold, quote = claim.threshold, claim.quote
        rows.append(
            [claim.statement, claim.source, answer, verdict.because, threshold, quote, numbers]
        )
    columns = ["claim", "source", "verdict", "because", "threshold", "the paper", "evidence"]
    return Table(name, "Claims", columns, rows)


def set_ups_table(
    name: str,
    claims: Iterable[Claim],
    campaigns: Mapping[str, Campaign],
    set_ups: Sequence[SetUp],
) -> Table:
    """Which set-up satisfies which claim; an empty table where there is one set-up only.

    A claim that does not depend on what a set-up changes has the stated answer there. The best
    combination of the set-ups comes last, where one satisfies more than each of them.

    Raises
    ------
    ValueError
        For more set-ups than `MOST_SET_UPS`.
    """
    if len(set_ups) > MOST_SET_UPS:
        raise ValueError(f"{len(set_ups)} set-ups; a table has at most {MOST_SET_UPS}")
    if len(set_ups) < 2:
        return Table(name, "", ["claim", *(set_up.name for set_up in set_ups)], [])
    judged = [_Judged(claim, campaigns, set_ups[0]) for claim in claims]
    best = best_combination(judged, set_ups) if len(set_ups) < MOST_SET_UPS else None
    shown = [*set_ups, best] if best is not None else list(set_ups)
    counts = {set_up.name: _count(judged, set_up.choices) for set_up in shown}
    rows: list[list[Any]] = []
    reasons: dict[str, list[str]] = {}
    for one in judged:
        row: list[Any] = [one.claim.statement]
        for set_up in shown:
            verdict = one.under(set_up.choices)
            files = tuple(dict.fromkeys(file for piece in verdict.evidence for file in piece.files))
            row.append(Cell(SHORT.get(verdict.short, ""), files))
            if verdict.answer == UNDECIDED:
                where = reasons.setdefault(f"{one.claim.statement}: {verdict.because}", [])
                where.append(set_up.name)
        rows.append(row)
    rows.append([f"hold, of {len(judged)}", *(Cell(count) for count in counts.values())])
    if reasons:
        empty = Counter(where for places in reasons.values() for where in places)
        rows.append(["not judged", *(Cell(empty[set_up.name]) for set_up in shown)])
    columns = ["claim", *counts]
    note = _summary(set_ups, best, counts, len(judged), reasons)
    return Table(name, "Claims and set-ups", columns, rows, note)


@dataclass
class _Judged:
    """A claim and its verdicts by the choices that it depends on: each is computed once."""

    claim: Claim
    campaigns: Mapping[str, Campaign]
    stated: SetUp
    found: dict[tuple[tuple[str, Any], ...], Verdict] = field(default_factory=dict)

    def under(self, choices: Mapping[str, Any]) -> Verdict:
        """The verdict when these are chosen otherwise than stated."""
        if () not in self.found:
            self.found[()] = judge_in(self.claim, self.campaigns, self.stated)
        touched = {key: choices[key] for key in sorted(self.found[()].asked & set(choices))}
        key = tuple(touched.items())
        if key not in self.found:
            self.found[key] = judge_in(self.claim, self.campaigns, SetUp("", touched))
        return self.found[key]


def _count(judged: Iterable[_Judged], choices: Mapping[str, Any]) -> int:
    """How many claims hold under these choices."""
    return sum(one.under(choices).answer == HOLDS for one in judged)


def best_combination(judged: Sequence[_Judged], set_ups: Sequence[SetUp]) -> SetUp | None:
    """The combination of set-ups that satisfies most claims, of equally good ones the shortest.

    None where no combination satisfies more than the best of the set-ups alone.
    """
    most = max(_count(judged, set_up.choices) for set_up in set_ups)
    best = None
    for size in range(2, len(set_ups)):
        for parts in combinations(set_ups[1:], size):
            # of two values of one choice the last counts: no more than a shorter combination has
            choices = {key: value for part in parts for key, value in part.choices.items()}
            count = _count(judged, choices)
            if count > most:
                most = count
                best = SetUp(f"best: {' and '.join(part.name for part in parts)}", choices)
    return best


def _summary(
    set_ups: Sequence[SetUp],
    best: SetUp | None,
    counts: Mapping[str, int],
    total: int,
    reasons: Mapping[str, Sequence[str]],
) -> str:
    """Whether any set-up satisfies all claims, which are left open by the paper, and what is missing."""
    full = [name for name, count in counts.items() if count == total]
    most = max(counts.values())
    where = ", ".join(name for name, count in counts.items() if count == most)
    parts = [
        f"All claims hold in: {', '.join(full)}."
        if full
        else f"No set-up satisfies all {total} claims; the most, {most}, hold in: {where}."
    ]
    if not full and best is None and 2 < len(set_ups) < MOST_SET_UPS:
        parts.append("No combination of these set-ups satisfies more.")
    undisclosed = dict.fromkeys(set_up.open for set_up in set_ups if set_up.open)
    if undisclosed:
        parts.append(f"The paper leaves open: {', '.join(undisclosed)}.")
    if reasons:
        empty = "; ".join(f"{reason} ({', '.join(where)})" for reason, where in reasons.items())
        parts.append(f"Empty cells: {empty}.")
    return " ".join(parts)
