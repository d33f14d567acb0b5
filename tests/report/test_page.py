"""The page and its files: complete, traceable, offline, and the same every time."""

import base64
import csv
import hashlib
import re
from functools import partial
from pathlib import Path

import pytest
from markupsafe import Markup

from mpmbench.report import build
from mpmbench.report.sections import Section, fitted
from mpmbench.report.series import studies
from mpmbench.report.tables import Cell, errors
from mpmbench.report.writer import Picture
from mpmbench.results.records import read_campaign

NAN = float("nan")
NOTHING_TO_DRAW = {
    "snapshot": False,
    "scalars": {"error_displacement_rms": NAN, "error_stress_rms": NAN},
}


@pytest.fixture(scope="module")
def quickstart(tmp_path_factory):
    """The report of the quick start, and its page's text."""
    from .conftest import make_quickstart

    folder = tmp_path_factory.mktemp("campaigns") / "quickstart"
    make_quickstart(folder)
    page = build(folder)
    return folder, page.read_text(encoding="utf-8")


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    with open(
        folder / "report" / "tables" / f"bar_fixed_ends-{name}.csv", encoding="utf-8"
    ) as file:
        return list(csv.DictReader(file))


def test_every_figure_and_table_is_written_in_its_formats(quickstart):
    folder, _ = quickstart
    drawn = {file.name for file in (folder / "report" / "figures").iterdir()}
    for stem in (
        "convergence_displacement",
        "convergence_stress",
        "work_precision",
        "stress_profile",
    ):
        assert {f"bar_fixed_ends-{stem}.{kind}" for kind in ("svg", "pdf", "png")} <= drawn
    written = {file.name for file in (folder / "report" / "tables").iterdir()}
    for stem in ("orders", "error_displacement-resolution", "timings", "failures", "runs"):
        assert {f"bar_fixed_ends-{stem}.{kind}" for kind in ("csv", "md", "tex")} <= written
    assert not list((folder / "report").rglob(".*")), "nothing half-written stays"


def test_the_page_can_be_read_by_keyboard_and_by_ear(quickstart):
    _, text = quickstart
    contents = re.search(r'<nav class="contents".*?</nav>', text, re.DOTALL).group()
    targets = re.findall(r'href="#([^"]+)"', contents)
    assert len(targets) == len(re.findall("<h2>", text)) > 1
    assert all(f'id="{target}"' in text for target in targets)
    heads = re.findall(r"<th\b[^>]*>", text)
    assert heads and all('scope="col"' in head for head in heads)
    tables, figures = text.count("<table>"), text.count("<figure ")
    regions = re.findall(r'<div class="scroll" tabindex="0" role="region" aria-label="[^"]+"', text)
    pictures = re.findall(r'<svg [^>]*role="img" aria-label="[^"]+"', text)
    assert len(regions) == tables > 0 and len(pictures) == figures > 0
    assert "prefers-color-scheme: dark" in text


def test_page_opens_offline(quickstart):
    _, text = quickstart
    loaded = re.findall(r'(?:src|href)="([^"]+)"', text) + re.findall(r"url\(([^)]+)\)", text)
    assert not [
        place
        for place in loaded
        if "//" in place and not place.startswith("data:image/png;base64,")
    ]
    assert "@import" not in text
    (script,) = re.findall(r"<script[^>]*>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src &#39;sha256-{digest}&#39;" in text or f"'sha256-{digest}'" in text
    assert len(text.encode()) < 2e6


def test_every_link_has_a_target(quickstart):
    folder, text = quickstart
    identifiers = re.findall(r'\bid="([^"]+)"', text)
    assert len(identifiers) == len(set(identifiers)), "identifiers are unique"
    for place in set(re.findall(r'href="([^"]+)"', text)):
        if place.startswith("#"):
            assert place[1:] in identifiers, place
        elif not place.startswith("data:"):
            assert (folder / "report" / place).exists(), place


def test_every_number_traces_to_a_file(quickstart):
    folder, text = quickstart
    files = {file.name for file in folder.glob("*.nc")}
    for name in ("orders", "error_displacement-resolution", "timings", "failures", "runs"):
        for row in rows(folder, name):
            assert row["files"] and set(row["files"].split()) <= files
    assert files == {file for row in rows(folder, "runs") for file in row["files"].split()}
    assert all(f'id="{file}"' in text for file in files)


def test_failures_carry_their_reasons(quickstart):
    folder, text = quickstart
    failed = {row["status"]: row for row in rows(folder, "failures")}
    assert set(failed) == {"broke down", "not applicable"}
    assert failed["broke down"]["reason"] == "particle 3 left the end knots at step 7 (t = 7e-05 s)"
    assert "particle 3 left the end knots" in text
    assert rows(folder, "error_displacement-resolution")[-1]["64 cells"] == "broke down"


def test_timings_are_relative_to_linear_mpm(quickstart):
    folder, _ = quickstart
    by_curve = {row["curve"]: row for row in rows(folder, "timings")}
    assert float(by_curve["OTM, linear (consistent mass)"]["8 cells [s]"]) == pytest.approx(
        1.2 * 8e-4
    )
    with open(
        folder / "report" / "tables" / "bar_fixed_ends-timings.csv", encoding="utf-8"
    ) as file:
        table = list(csv.reader(file))
    ratios = {row[0]: [float(value) for value in row[2:-1:2] if value] for row in table[1:]}
    assert ratios["OTM, max-ent (consistent mass)"] == pytest.approx([3.6] * 4)
    assert ratios["unified, B-spline (consistent mass)"] == pytest.approx([1.0] * 3), (
        "the failed run has no time"
    )


@pytest.mark.usefixtures("only_svg")
@pytest.mark.slow  # a page; the sentence for timings that are all shared below
def test_shared_timings_stay_out_of_the_table(tmp_path, write_run):
    for resolution in (8, 16):
        write_run(
            tmp_path, "mpm", resolution=resolution, timing_context="exclusive", snapshot=False
        )
        write_run(tmp_path, "otm", resolution=resolution, timing_context="shared", snapshot=False)
    build(tmp_path)
    assert [row["curve"] for row in rows(tmp_path, "timings")] == ["MPM, linear"]
    assert (
        "2 runs that shared the machine are left out"
        in (tmp_path / "report" / "index.html").read_text()
    )


@pytest.mark.usefixtures("only_svg")
def test_without_exclusive_timings_the_table_is_indicative_and_says_how_to_get_a_real_one(
    tmp_path, write_run
):
    write_run(tmp_path, timing_context="shared", snapshot=False)
    text = build(tmp_path).read_text()
    assert "indicative only: the runs were not timed alone" in text
    assert "timing=exclusive" in text
    assert rows(tmp_path, "timings")


@pytest.mark.slow
def test_same_results_give_the_same_bytes(quickstart, tmp_path):
    folder, _ = quickstart
    build(folder, tmp_path)
    first, second = (
        {file.relative_to(place): file.read_bytes() for file in place.rglob("*") if file.is_file()}
        for place in (folder / "report", tmp_path)
    )
    assert len(first) > 20
    assert [name for name in first if first[name] != second.get(name)] == []


@pytest.mark.usefixtures("only_svg")
def test_a_second_report_leaves_no_stale_file_and_no_foreign_file_is_touched(tmp_path, write_run):
    bad = write_run(tmp_path, status="crashed", reason="boom")
    write_run(tmp_path, resolution=16, **NOTHING_TO_DRAW)
    build(tmp_path)
    mine = tmp_path / "report" / "tables" / "notes.md"
    mine.write_text("mine")
    assert (tmp_path / "report" / "tables" / "bar_fixed_ends-failures.md").exists()
    bad.unlink()
    build(tmp_path)
    assert not (tmp_path / "report" / "tables" / "bar_fixed_ends-failures.md").exists()
    assert mine.read_text() == "mine"


@pytest.mark.usefixtures("only_svg")
def test_reasons_cannot_break_the_page_or_the_tables(tmp_path, write_run):
    write_run(tmp_path, status="crashed", reason="<script>alert(1)</script> | 5 % of x_1 & more")
    text = build(tmp_path).read_text()
    assert "<script>alert" not in text and "&lt;script&gt;alert(1)" in text
    tables = tmp_path / "report" / "tables"
    assert r"\| 5 % of x_1" in (tables / "bar_fixed_ends-failures.md").read_text()
    assert r"5 \% of x\_1 \& more" in (tables / "bar_fixed_ends-failures.tex").read_text()


@pytest.mark.usefixtures("only_svg")
def test_campaign_without_any_result_still_reports_its_failures(tmp_path, write_run):
    write_run(tmp_path, status="diverged", reason="velocity is not finite at step 12")
    (tmp_path / "broken.nc").write_bytes(b"")
    text = build(tmp_path).read_text()
    assert "velocity is not finite at step 12" in text
    assert "1 file is damaged or no result, and left out" in text and "broken.nc" in text


@pytest.mark.usefixtures("only_svg")
def test_only_unreadable_files_still_make_a_page(tmp_path):
    (tmp_path / "broken.nc").write_bytes(b"nothing")
    assert "broken.nc" in build(tmp_path).read_text()


@pytest.mark.usefixtures("only_svg")
def test_runs_of_different_code_are_pointed_out(tmp_path, write_run):
    for resolution, code in ((8, "aaaa"), (16, "bbbb")):
        write_run(tmp_path, resolution=resolution, code_hash=code, **NOTHING_TO_DRAW)
    assert "2 different versions of the code" in build(tmp_path).read_text()


def test_tables_show_significant_zeros(tmp_path, write_run):
    write_run(tmp_path, resolution=8, scalars={"error_displacement_rms": 1.7031e-6}, snapshot=False)
    (study,) = studies(read_campaign(tmp_path))
    table = errors(study, "error_displacement_rms")
    assert "| 1.70e-06 |" in table.markdown()
    assert r"MPM, linear & 1.70e-06 \\" in table.latex()
    shown = {
        1.7031e-6: "1.70e-06",
        0.01: "0.01",
        80.0: "80",
        2114.2: "2114",
        0.1499999: "0.150",
        1e9: "1e+09",
    }
    assert {value: Cell(value).text for value in shown} == shown


def test_a_page_without_room_drops_what_tells_least_and_of_that_the_largest():
    stems = {"histories": 20, "map_pressure": 10, "convergence_stress": 90, "map_von_mises": 40}
    stems |= {"atlas": 30, "map_pressure-more": 15}

    def kept(most: int) -> set[str]:
        pictures = [
            Picture(f"bar-{stem}", stem, "", Markup("s" * size)) for stem, size in stems.items()
        ]
        one = Section("first", None, None, pictures=pictures[:3])
        two = Section("second", None, None, pictures=pictures[3:])
        found = [picture for section in fitted([one, two], most) for picture in section.pictures]
        assert [picture.title for picture in found] == [*stems]  # its heading and files stay
        assert sum(len(picture.svg) for picture in found) <= max(most, 0)
        return {picture.title for picture in found if picture.svg}

    assert kept(205) == {*stems}
    assert kept(204) == {*stems} - {"map_pressure-more"}
    assert kept(189) == {*stems} - {"map_pressure-more", "map_pressure"}
    assert kept(160) == {"histories", "convergence_stress", "atlas"}
    assert kept(119) == {"convergence_stress"}
    assert kept(89) == set()


@pytest.mark.usefixtures("only_svg")
@pytest.mark.slow  # two pages; what is dropped is asked above
def test_a_drawing_that_was_dropped_is_in_its_file(tmp_path, write_run, monkeypatch):
    for resolution in (4, 8):
        write_run(tmp_path, resolution=resolution)
    whole = build(tmp_path).read_text(encoding="utf-8")
    monkeypatch.setattr("mpmbench.report.page.fitted", partial(fitted, most=0))
    text = build(tmp_path).read_text(encoding="utf-8")
    assert "<svg" in whole and "<svg" not in text and "<button" not in text
    assert whole.count("<figure") == text.count("<figure") == text.count("it is in its files")
    for name in re.findall(r'href="(figures/[^"]+\.svg)"', text):
        assert "<svg" in (tmp_path / "report" / name).read_text(encoding="utf-8")
