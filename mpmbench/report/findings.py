"""What was found on a problem, in sentences computed from its runs."""

from collections.abc import Iterator

import numpy as np

from mpmbench.report import atlas, coincide, front, timing
from mpmbench.report.figures import unit_text
from mpmbench.report.quantities import last_values, names_of
from mpmbench.report.series import Study
from mpmbench.report.tables import number_text

MOST_CAUSES = 4  # of failure that are told one by one
MOST_QUANTITIES = 4  # of interest that are told; the table has all
MOST_CURVES = 3  # that a sentence names
ENDED = {
    "diverged": "diverged",
    "broke_down": "broke down",
    "not_converged": "did not converge",
    "timeout": "reached the limit of time",
    "out_of_memory": "ran out of memory",
    "crashed": "crashed",
    "interrupted": "was interrupted",
}


def findings(study: Study) -> list[str]:
    """Who is best up to which cost, what the problem asks for, what failed and why, what coincides."""
    return [*_best(study), *_asked(study), *_failed(study), *_same(study)]


def _best(study: Study) -> Iterator[str]:
    for field in front.fields(study):
        if len(field.results):
            several = field.problem != study.problem
            yield (
                f"{field.problem.replace('_', ' ')}: {field.sentence()}"
                if several
                else field.sentence()
            )


def _asked(study: Study) -> Iterator[str]:
    """The range of each quantity of interest at the finest value that most curves share."""
    compared = front.quantity_of(study.runs)
    for name in [one for one in names_of(study) if one != compared][:MOST_QUANTITIES]:
        values = last_values(study, name)
        if not values:
            continue
        low, high = min(values, key=values.__getitem__), max(values, key=values.__getitem__)
        unit = unit_text(study.campaign.units.get(name, ""))
        unit = f" {unit}" if unit else ""
        text = name.replace("_", " ")
        if number_text(values[low]) == number_text(values[high]):
            number = len(values)
            all_of = (
                ("", " for both curves")[number - 1] if number < 3 else f" for all {number} curves"
            )
            yield f"{_capital(text)}: {number_text(values[low])}{unit}{all_of}."
        else:
            yield (
                f"{_capital(text)}: from {number_text(values[low])}{unit} ({low}) "
                f"to {number_text(values[high])}{unit} ({high})."
            )


def _failed(study: Study) -> Iterator[str]:
    """How runs ended without a result, and why; first those that failed, then those that do not apply."""
    found = atlas.causes(study)
    failed = [cause for cause in found if cause.status != "not_applicable"]
    count = sum(len(cause.files) for cause in failed)
    if count:
        yield f"{count} of {len(study.runs)} {_plural(len(study.runs), 'run')} failed."
    for cause in failed[:MOST_CAUSES]:
        reason = f": {cause.reason}" if cause.reason else ""
        yield f"{_where(study, cause.files)} {ENDED.get(cause.status, cause.status)}{reason}."
    if len(failed) > MOST_CAUSES:
        yield f"{len(failed) - MOST_CAUSES} further reasons stand in the table below."
    left = sum(len(cause.files) for cause in found) - count
    if left:
        yield f"{left} {_plural(left, 'run')} {'does' if left == 1 else 'do'} not apply to this problem."


def _where(study: Study, files: list[str]) -> str:
    """``OTM, linear at 8, 16 cells; GMM, LME at 8 cells and 3 more curves``."""
    parts = []
    for one in study.series:
        mine = one.runs.loc[[file for file in one.runs.index if str(file) in files]]
        if not len(mine):
            continue
        values = [f"{value:g}" for value in sorted(set(mine.axis_value)) if np.isfinite(value)]
        at = f" at {', '.join(values)} {study.axis.unit}" if values else ""
        parts.append(one.label + at)
    more = len(parts) - MOST_CURVES
    text = "; ".join(parts[:MOST_CURVES])
    return f"{text} and {more} more {_plural(more, 'curve')}" if more > 0 else text


def _same(study: Study) -> Iterator[str]:
    for quantity in ("error_displacement_rms", "error_stress_rms"):
        found = coincide.sentences(study, quantity)
        what = quantity.removeprefix("error_").removesuffix("_rms")
        yield from (f"In their {what} error {sentence}" for sentence in found)
        if found:
            return


def times(studies: list[Study]) -> str:
    """A sentence about the costs that all findings name; empty when each run was timed alone and undisturbed."""
    told = []
    if any(timing.compared(study)[1] == "shared" for study in studies):
        told.append("the runs were not timed alone")
    heads = [timing.clock_of(timing.compared(study)[0]).head for study in studies]
    if any(heads):
        told.append("other work kept the machine busy")
    return f"Costs are indicative only: {' and '.join(told)}." if told else ""


def _plural(number: int, word: str) -> str:
    return word if number == 1 else f"{word}s"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
