"""The command ``compare``: what has become better or worse from one campaign to another.

Failures, accuracy, order and speed are judged separately, over the runs with the same
configuration.
"""

from pathlib import Path
from typing import Any

import pandas as pd

from mpmbench.commands.compare.aspect import accuracy, failures, orders
from mpmbench.commands.compare.speed import speed
from mpmbench.results.campaign import flat_settings
from mpmbench.results.netcdf import read_attributes, unverified
from mpmbench.results.records import Campaign, read_campaign
from mpmbench.say import BELOW, in_lines, say
from mpmbench.settings.schema import BadInput
from mpmbench.settings.words import in_yaml

# Exit codes; of several reasons the first counts.
NOT_COMPARABLE, NEW_FAILURES, LESS_ACCURATE, SLOWER, UNDECIDED = 20, 12, 11, 10, 30


def main(arguments: list[str]) -> int:
    """``compare A B``: two folders of results, the older one first."""
    if len(arguments) != 2:
        example = "`compare results/a results/b`"
        raise BadInput(
            f"compare: two folders of results are needed, the older one first: {example}"
        )
    before, after = (read(Path(argument)) for argument in arguments)
    reason = not_comparable(before, after)
    if reason:
        say(*in_lines(f"not comparable: {reason}", BELOW))
        return NOT_COMPARABLE
    pairs = paired(before, after)
    alone = [len(campaign.runs) - len(pairs) for campaign in (before, after)]
    say(f"{len(pairs)} runs in both, {alone[0]} only in A, {alone[1]} only in B")
    if all(alone):
        left = [
            before.runs.index.difference(pairs.file_a),
            after.runs.index.difference(pairs.file_b),
        ]
        say(*in_lines(f"these differ in {differing(before, after, *left)}", BELOW))
    good = pairs[(pairs.status_a == "ok") & (pairs.status_b == "ok")]
    failed, errors, order = failures(pairs), accuracy(good), orders(before, after, good)
    times, verdict = speed(before, after, good)
    for aspect in (failed, errors, order, times):
        say(*aspect.told())
    if failed.verdicts["new"]:
        return NEW_FAILURES
    if errors.verdicts["worse"] or order.verdicts["worse"]:
        return LESS_ACCURATE
    return {"worse": SLOWER, "undecided": UNDECIDED}.get(verdict, 0)


def read(folder: Path) -> Campaign:
    """The results of a folder, one for each configuration."""
    try:
        campaign = read_campaign(folder)
    except FileNotFoundError as error:
        raise BadInput(f"compare: {error}") from None
    for name, reason in campaign.unreadable.items():
        say(*in_lines(f"left out: {folder / name}: {reason}", BELOW))
    told = unverified(campaign.unverified)
    if told:
        say(*in_lines(f"{folder}: {told}", BELOW))
    if campaign.runs.empty:
        return campaign
    again = campaign.runs.config_hash.duplicated()
    for name in campaign.runs.index[again]:
        why = "another file has the same configuration"
        say(*in_lines(f"left out: {folder / name}: {why}", BELOW))
    return campaign.only(~again)


def not_comparable(before: Campaign, after: Campaign) -> str:
    """Why two campaigns cannot be compared; empty when they can."""
    if before.runs.empty or after.runs.empty:
        return "one of them has no readable result"
    if not set(before.runs.config_hash) & set(after.runs.config_hash):
        files = (before.runs.index, after.runs.index)
        return f"no configuration is in both; they differ in {differing(before, after, *files)}"
    return ""


def differing(before: Campaign, after: Campaign, old: pd.Index, new: pd.Index) -> str:
    """Settings in which some files of one campaign have nothing in common with some of another.

    If there are none, those of which any value is in one only.
    """
    sides = [
        [flat_settings(read_attributes(campaign.folder / file)) for file in files]
        for campaign, files in ((before, old), (after, new))
    ]
    values = {
        key: [{in_words(run.get(key)) for run in side} for side in sides]
        for key in sorted({key for side in sides for run in side for key in run})
    }
    apart = [key for key, (a, b) in values.items() if not a & b]
    other = [key for key, (a, b) in values.items() if a != b]
    told = [
        f"{key} ({', '.join(sorted(values[key][0]))} in A, {', '.join(sorted(values[key][1]))} in B)"
        for key in apart or other
    ]
    return ", ".join(told) or "how their settings go together"


def in_words(value: Any) -> str:
    """A setting as it is printed."""
    return "not set" if value is None else str(in_yaml(value))


def paired(before: Campaign, after: Campaign) -> pd.DataFrame:
    """Runs of the same configuration side by side: columns end in ``_a`` and ``_b``, the index is B's file."""
    columns = [
        runs.drop(columns="file", errors="ignore")
        .reset_index(names="file")
        .set_index("config_hash")
        for runs in (before.runs, after.runs)
    ]
    return columns[0].add_suffix("_a").join(columns[1].add_suffix("_b"), how="inner")
