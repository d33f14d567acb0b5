"""All orders of the committed reports: within their local slopes, and one for each curve."""

import csv
import re
from pathlib import Path

import pytest

REPORTS = Path(__file__).parents[2] / "reports"
TWO_DIGITS = 0.0051  # of a printed slope
NEAR, FALLS = 0.056, 0.11  # how far an asymptotic order may be outside, and a slope above the last
NUMBER = re.compile(r"-?\d+\.\d+")
REASONS = ("without a floor of", "is a floor", "if the slopes drift on")


def tables(folder):
    """Every table of a report that has orders: its name and its rows."""
    for file in sorted(folder.glob("tables/*.csv")):
        with file.open(encoding="utf-8") as text:
            rows = list(csv.DictReader(text))
        if rows and "local slopes" in rows[0]:
            yield file.name, rows


def faults(folder):
    """What is wrong with the orders of a report, one line each."""
    known = {}
    for name, rows in tables(folder):
        for row in rows:
            where = f"{name}: {row.get('curve') or row.get('variant')}"
            yield from (f"{where}: {fault}" for fault in outside(row))
            runs = frozenset(file.rpartition("/")[2] for file in row["files"].split())
            order, _, levels = row["order"].partition(" over ")
            said = known.setdefault((error_of(row), runs), order)
            if said != order:
                yield f"{where}: {order}, and elsewhere {said}"
            if not levels and not ({"cells", "s"} & set(row)):
                yield f"{where}: no levels beside the order"


def error_of(row):
    """Which error a row is about; the table of variants has the displacement, once in another norm."""
    other = "Eq. 102" in row.get("variant", "")
    return row["variant"] if other else row.get("error", "RMS displacement error [m]")


def outside(row):
    """Whether an order lies outside the local slopes of its curve without a reason."""
    local = [float(slope) for slope in NUMBER.findall(row["local slopes"])]
    order, asymptotic = row["order"].partition(" over ")[0], row["asymptotic order"]
    if not local:
        if NUMBER.search(order + asymptotic):
            yield f"{order}, {asymptotic}: an order without slopes"
        return
    low, high = min(local), max(local)
    for number in map(float, NUMBER.findall(order)):
        if not low - TWO_DIGITS <= number <= high + TWO_DIGITS:
            yield f"{order} outside {row['local slopes']}"
    stated = re.match(r"-?\d+\.\d+", order)
    if stated and float(stated[0]) > max(local[-2:]) + FALLS and "falling to" not in order:
        yield f"{order} although the last slopes of {row['local slopes']} are lower"
    named = re.match(r"(-?\d+\.\d+) [±(]", asymptotic)
    reason = any(reason in asymptotic for reason in REASONS)
    if named and not low - NEAR <= float(named[1]) <= high + NEAR and not reason:
        yield f"asymptotic {asymptotic} outside {row['local slopes']} without a reason"


@pytest.mark.parametrize("paper", ["iaconeta2017", "li2009", "wobbes2020"])
def test_no_order_of_a_report_is_outside_its_slopes_and_no_curve_has_two(paper):
    found = list(tables(REPORTS / paper))
    assert found or paper == "iaconeta2017", "its orders are in the claims only"
    assert list(faults(REPORTS / paper)) == []


@pytest.mark.parametrize(
    ("order", "local", "asymptotic", "fault"),
    [
        ("2.67", "1.78, 0.57", "none", "2.67 outside"),
        ("1.42 (0.17 to 2.07)", "2.07, 0.40, 0.17", "none", "although"),
        ("levels off: last slope 0.17", "2.07, 1.42, 0.17", "2.64 (1.92 to 2.98)", "reason"),
        ("none", "", "0.57 to 4.63", "without slopes"),
        ("levels off: last slope 0.17", "2.07, 1.42, 0.17", "none", ""),
        ("1.53 (1.99 falling to 1.07)", "1.99, 1.07", "none", ""),
        (
            "uneven: slopes 0.14 to 1.84",
            "1.84, 0.14",
            "2.21 ± 0.13 without a floor of 1.5e-08 m",
            "",
        ),
        ("round-off", "", "none", ""),
    ],
)
def test_a_wrong_order_is_found(order, local, asymptotic, fault):
    row = {"order": order, "local slopes": local, "asymptotic order": asymptotic}
    found = list(outside(row))
    assert any(fault in line for line in found) if fault else found == []


def test_two_orders_of_one_curve_are_found(tmp_path):
    (tmp_path / "tables").mkdir()
    head = "curve,error,order,local slopes,asymptotic order,cells,files"
    for name, order in (("a", "2.16"), ("b", "2.10")):
        row = f'unified,RMS,{order},"2.00, 2.20",none,8 16 32,{name}/x.nc {name}/y.nc {name}/z.nc'
        (tmp_path / "tables" / f"{name}.csv").write_text(f"{head}\n{row}\n")
    assert list(faults(tmp_path)) == ["b.csv: unified: 2.10, and elsewhere 2.16"]
