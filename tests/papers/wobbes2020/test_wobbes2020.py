"""The report on Wobbes et al. 2020: claims follow from runs, cells trace to files, variants are what they say."""

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from mpmbench.case import solve
from mpmbench.commands import bisect
from mpmbench.core import registry
from mpmbench.core.geometry import Box
from mpmbench.papers import (
    Campaigns,
    Chapter,
    MissingRuns,
    Paper,
    cell,
    find,
    names,
    read_campaigns,
)
from mpmbench.papers import page as paper_page
from mpmbench.papers.kit import subset
from mpmbench.papers.wobbes2020 import errata, spectra, survival, table1
from mpmbench.papers.wobbes2020.claims import algorithms, traction
from mpmbench.report.claims import FAILS, HOLDS, UNDECIDED, Claim, SetUp, judge, judge_in
from mpmbench.results import completion
from mpmbench.runs.hydra import compose
from mpmbench.settings import schema
from tests.core import support
from tests.support import edited, slow_if

ROOT = Path(__file__).parents[3]
EXPERIMENTS = ROOT / "experiments" / "wobbes2020"
ERROR = "error_displacement_rms"


@pytest.fixture
def plugins(monkeypatch):
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(EXPERIMENTS / "plugins"))


# the claims


def write_orders(write_run, folder, order, lumped_order=2.0):
    """Max-ent runs of the campaign ``orders`` with given orders."""
    for n in (8, 16, 32, 64):
        for method, mass in (("mpm", "consistent"), ("otm", "consistent"), ("mpm", "lumped")):
            p = lumped_order if mass == "lumped" else order
            settings = {"method": {"mass": mass}, "basis": {"name": "maxent", "search": "local"}}
            write_run(
                folder,
                method,
                "maxent",
                n,
                mass=mass,
                order=p,
                floor=0.0,
                settings=settings,
                snapshot=False,
            )


def verdict(name, folder):
    return judge(claim_called(name), read_campaigns(folder))


def claim_called(name):
    return next(claim for claim in find("wobbes2020").claims if claim.name == name)


def test_a_doctored_run_changes_the_verdict_on_the_order_of_maxent(tmp_path, write_run):
    write_orders(write_run, tmp_path / "orders", order=3.5)
    found = verdict("maxent_order", tmp_path)
    assert found.answer == FAILS and "MPM-maxent 3.50" in found.because
    assert all(file.startswith("orders/") for piece in found.evidence for file in piece.files)
    write_orders(write_run, tmp_path / "orders", order=1.5)
    assert verdict("maxent_order", tmp_path).answer == HOLDS
    write_orders(write_run, tmp_path / "orders", order=2.05)
    assert verdict("maxent_order", tmp_path).answer == FAILS, "no slack at the ends"


def at_the_edge(errors):
    """Fields of Fig. 7 with these errors of the stress beyond 0.95 m, by load and particles."""

    def fields(campaigns, campaign, *wanted, **match):
        load, count = match["method__traction"], match["particles_per_cell"]
        x = np.array([[0.5], [0.96], [0.99]])
        exact = np.zeros((3, 1, 1))
        stress = errors[load, count] * np.array([99.0, 1.0, -1.0])[:, None, None]
        found = {"position_initial": x, "stress": stress, "stress_exact": exact}
        return f"fig7/{load}-{count}.nc", found

    return fields


@pytest.mark.parametrize(
    ("many", "moved", "answer"),
    [
        (0.03, 0.1, HOLDS),
        (0.03, 0.01, "holds in part: for more particles help; not for the place of the load is"),
        (0.09, 0.1, "holds in part: for the place of the load is no cause; not for more particles"),
        (0.09, 0.01, FAILS),
    ],
)
def test_the_right_edge_is_judged_there(monkeypatch, many, moved, answer):
    errors = {("last_particle", 4): 0.1, ("last_particle", 16): many}
    errors |= {("end_point", 4): moved, ("end_point", 16): moved * many / 0.1}
    monkeypatch.setattr(traction, "fields", at_the_edge(errors))
    found = judge(claim_called("edge_quadrature"), {})
    assert found.answer.startswith(answer) and "falls from 0.1 to" in found.because


@pytest.mark.parametrize(
    ("shift", "holds"), [(0.0, True), (1e-17, False)], ids=["equal", "one bit apart"]
)
def test_methods_are_equivalent_to_the_last_bit(monkeypatch, shift, holds):
    def variables(campaigns, campaign, *wanted, **match):
        moved = shift if campaign == "fig7" and match["basis"] == "maxent" else 0.0
        return f"{campaign}/a.nc", {"position": np.array([[[0.1], [moved]]])}

    monkeypatch.setattr(algorithms, "variables", variables)
    assert (judge(claim_called("equivalence"), {}).answer == HOLDS) == holds


def test_a_comparison_that_turns_on_the_mass_is_not_decidable(tmp_path, write_run):
    claims = find("wobbes2020")
    errors = {"fixed": 3e-6, "moving": 1e-6}
    for basis, mass in itertools.product(("linear", "maxent", "bspline"), ("lumped", "consistent")):
        for nodes, traction_at in (
            *(("fixed", "last_particle"), ("fixed", "end_point"), ("moving", "end_point")),
        ):
            moving = nodes == "moving"
            lumped_otm = moving and mass == "lumped" and basis == "maxent"
            transfer = "position_difference" if moving and basis != "bspline" else "flip"
            method = {"mass": mass, "nodes": nodes, "transfer": transfer}
            method |= {"traction": traction_at, "shape_functions": "updated"}
            write_run(
                tmp_path / "ablation", "mpm", basis, 68, mass=mass, settings={"method": method},
                scalars={ERROR: 3e-4 if lumped_otm else errors[nodes]}, snapshot=False,
            )  # fmt: skip
    claim, campaigns = claim_called("better_than_mpm"), read_campaigns(tmp_path)
    assert judge(claim, campaigns).answer == HOLDS
    found = judge(claim, campaigns, claims.set_ups)
    assert found.answer == "not decidable: the paper leaves the mass matrix of MPM and OTM open"
    assert "not for OTM-maxent" in found.because


def test_missing_campaigns_leave_every_claim_undecided(tmp_path, write_run):
    write_run(tmp_path / "other")
    for claim in find("wobbes2020").claims:
        found = judge(claim, read_campaigns(tmp_path))
        assert found.answer == UNDECIDED and found.because, claim.name


def write_set_up(write_run, folder, method, cells, sign, layout, fails):
    """One run of the campaign ``breakdown``."""
    problem = {"domain_cells": cells, "traction_amplitude": sign, "particle_layout": layout}
    write_run(
        folder, method, "bspline", 68, mass="consistent", snapshot=False,
        settings={"problem": problem, "method": {"mass": "consistent"}},
        status="broke_down" if fails else "ok", scalars={"time_reached": 0.3} if fails else None,
    )  # fmt: skip


def test_the_stability_claim_follows_the_map(tmp_path, write_run):
    broken = {("mpm", 79, -1.0, "midpoint"), ("mpm", 85, 1.0, "aligned")}
    for cells, sign in itertools.product(survival.NODES, survival.SIGNS):
        for run in itertools.product(("mpm", "unified"), [cells], [sign], survival.LAYOUTS):
            write_set_up(write_run, tmp_path / "breakdown", *run, fails=run in broken)
        problem = {"domain_cells": cells, "traction_amplitude": sign}
        settings = {"problem": problem, "method": {"mass": "consistent", "mass_cutoff": 1e-6}}
        write_run(tmp_path / "cutoff", "mpm", "bspline", 68, settings=settings, snapshot=False)
    found = verdict("stays_stable", tmp_path)
    assert found.answer.startswith("not decidable: the paper leaves what counts as a node")
    assert "1 of 8" in found.because and "1 of 12" in found.because
    without = {"mass_cutoff": 1e-6}
    found = judge_in(claim_called("stays_stable"), read_campaigns(tmp_path), SetUp("", without))
    assert found.answer == FAILS and "0 of 10" in found.because
    write_set_up(write_run, tmp_path / "breakdown", "unified", 79, -1.0, "midpoint", fails=True)
    assert verdict("stays_stable", tmp_path).answer == FAILS


# numbers and files


def test_table_of_times_pairs_the_repeats(tmp_path, write_run):
    # the machine is ten times slower during the second repeat; the third repeat has no partner
    for method, mass, times in (
        ("mpm", "lumped", [2.0, 20.0, 7.0]),
        ("otm", "consistent", [3.0, 30.0]),
    ):
        settings = {"method": {"mass": mass}}
        file = write_run(
            tmp_path / "table1", method, "linear", 31, mass=mass, settings=settings, snapshot=False
        )
        with edited(file) as data:
            data.solver_times = times
    found, files = table1.ratios(read_campaigns(tmp_path)["table1"], "OTM-P1", 31)
    assert np.allclose(found, 1.5) and len(found) == 2 and len(files) == 2
    write_run(
        tmp_path / "table1",
        "mpm",
        "linear",
        31,
        settings={"method": {"mass": "lumped"}},
        timing_context="shared",
    )
    with pytest.raises(MissingRuns):
        table1.ratios(read_campaigns(tmp_path)["table1"], "OTM-P1", 31)


def test_cells_name_their_file_and_failed_runs_show_their_status(tmp_path, write_run):
    good = write_run(tmp_path / "bar", "mpm", resolution=8)
    write_run(tmp_path / "bar", "otm", resolution=8, status="diverged")
    campaigns = read_campaigns(tmp_path)
    assert cell(campaigns, "bar", ERROR, method="mpm").files == (f"bar/{good.name}",)
    assert cell(campaigns, "bar", ERROR, method="otm").value == "diverged"
    assert cell(campaigns, "bar", ERROR, method="fem").files == ()
    assert list(subset(campaigns["bar"], method="mpm").runs.index) == [f"bar/{good.name}"]
    assert len(campaigns["bar"].variables(f"bar/{good.name}", ["stress"])["stress"]) == 2


def make_bar(campaigns: Campaigns) -> Chapter:
    chapter = Chapter("bar", "A bar", "The paper: order 2.")
    chapter.convergence(campaigns["bar"])
    return chapter


def make_nothing(campaigns: Campaigns) -> Chapter:
    return Chapter("x", str(campaigns["no_such_runs"]))


def test_a_paper_becomes_a_page_a_readme_and_small_files(tmp_path, write_run, monkeypatch):
    runs = [
        write_run(tmp_path / "results" / "mini" / "bar", "otm", resolution=n) for n in (8, 16, 32)
    ]
    rule = Claim(
        "c",
        "Errors are small",
        "Fig. 1",
        lambda r: (HOLDS, f"{r.number('bar', ERROR, resolution=8):.3g} m"),
    )
    paper = Paper("mini", "A paper", "Somebody 2020", (make_bar, make_nothing), (rule,))
    monkeypatch.setattr(paper_page, "find", lambda name: paper)
    page = paper_page.build("mini", tmp_path / "results", tmp_path / "report")
    html, readme = page.read_text(), (page.parent / "README.md").read_text()
    for run in runs:
        assert f'id="bar/{run.name}"' in html and f'href="#bar/{run.name}"' in html
    assert not re.search(r"https?:", html.replace("http://www.w3.org", ""))
    assert "no_such_runs" in html and "no_such_runs" in readme
    assert "| Errors are small (Fig. 1) | holds | " in readme
    assert (
        "(figures/bar-displacement.svg)" in readme
        and (page.parent / "figures/bar-displacement.svg").exists()
    )
    assert runs[0].name in (page.parent / "tables/bar-displacement.csv").read_text()
    assert "\\toprule" in (page.parent / "tables/bar-displacement.tex").read_text()
    assert not [link for link in links(readme) if not (page.parent / link).exists()]


def links(readme):
    return [link for link in re.findall(r"\]\(([^)]+)\)", readme) if not link.startswith("http")]


def test_the_paper_is_found_by_name():
    assert "wobbes2020" in names()
    with pytest.raises(KeyError):
        find("page")
    assert (
        len({claim.name for claim in find("wobbes2020").claims})
        == len(find("wobbes2020").claims)
        >= 11
    )


# the experiments


STUDIES = (  # beyond the figures of the paper, of many cells each
    *("large_strain", "large_strain_plate", "orders", "plate_orders", "quadrature"),
    *("stability", "time_step", "time_step_plate"),
)


@pytest.mark.parametrize(
    "file",
    [slow_if(file.stem in STUDIES, file) for file in sorted(EXPERIMENTS.glob("*.yaml"))],
    ids=lambda file: file.stem,
)
def test_every_experiment_composes_and_says_what_it_mirrors(file, plugins):
    content = yaml.safe_load(file.read_text())
    assert content["hydra"]["mode"] == "MULTIRUN" and file.read_text().splitlines()[1].startswith(
        "# "
    )
    params = [
        f"{key}={str(value).split(',')[0]}"
        for key, value in content["hydra"]["sweeper"]["params"].items()
    ]
    typed = [word for word in params if word.startswith(("basis=", "problem="))]
    rest = [word for word in params if word not in typed]
    combinations = []
    for case in content.get("cases") or [""]:
        words = case.split()
        keys = {word.partition("=")[0] for word in words}
        kept = [word for word in [*typed, *rest] if word.partition("=")[0] not in keys]
        combinations.append([f"experiments=wobbes2020/{file.stem}", *words, *kept])
    for config, reason in compose.compose_many(combinations):
        assert reason == "" and config["campaign"] == f"wobbes2020/{file.stem}"


def test_plug_ins_of_a_paper_are_no_experiments():
    assert "wobbes2020/errata" in schema.experiments()
    assert not [name for name in schema.experiments() if "plugins" in name]


# the variants of the errata study


@pytest.fixture(scope="module")
def printed():
    for file in sorted((EXPERIMENTS / "plugins").glob("*.py")):
        registry.load_file(file)
    return registry.get("basis", "maxent_printed")


@pytest.mark.parametrize("dimension", [1, 2])
def test_the_corrected_gradient_is_exact_and_the_printed_one_is_not(printed, dimension):
    box = Box((0.0,) * dimension, (1.0,) * dimension, (8,) * dimension)
    x = np.random.default_rng(1).uniform(0.15, 0.85, (40, dimension))
    exact = (
        registry.get("basis", "maxent")()
        .build(box, 40, True)
        .evaluate(x)
        .gradient_matrix(9**dimension)
    )
    found = {
        kind: printed(gradient=kind).build(box, 40, True).evaluate(x).gradient_matrix(9**dimension)
        for kind in ("corrected", "sign_corrected", "printed")
    }
    assert np.abs(found["corrected"] - exact).max() < 1e-8 * np.abs(exact).max()
    assert np.array_equal(found["printed"], -found["sign_corrected"])
    assert np.abs(found["sign_corrected"] - exact).max() > 0.01 * np.abs(exact).max()


def test_conclusions_follow_from_the_errors():
    def variant(*errors):
        return [table1.Cell(value) for value in errors]

    flat, second = variant(1e-5, 1e-5, 1e-5, 1e-5), variant(1e-4, 2.5e-5, 6.2e-6, 1.6e-6)
    errors = dict.fromkeys((name for name, _, _ in errata.VARIANTS), second)
    assert errata.conclusions(errors, []) == []
    errors |= {"Eq. 84, sign of A": flat, "Eq. 84 as printed": flat}
    assert "no explanation" in errata.conclusions(errors, [])[0]
    assert errata.between_one_and_two(errata.order_of(second)) and not errata.between_one_and_two(
        errata.order_of(flat)
    )


# bisection


def files(folder):
    return {file.name for file in (folder / "runs").glob("*.nc")}


def test_bisection_halves_the_interval_of_each_case_and_stops(tmp_path, write_run):
    file = tmp_path / "stability.yaml"
    file.write_text(
        "# @package _global_\n# reproduce: bisect cfl to 0.1\ncases:\n  - method=mpm\n  - method=otm\n"
    )
    wanted = bisect.asked_for(file)
    assert wanted is not None and (wanted.key, wanted.tolerance) == ("cfl", 0.1)

    def write(method, cfl, status):
        path = write_run(
            tmp_path / "runs", method, status=status, snapshot=False, constant=cfl, time_step=cfl
        )
        with edited(path) as data:
            data.config = json.dumps(json.loads(data.config) | {"cfl": cfl})

    for method in ("mpm", "otm"):
        write(method, 0.5, "ok")
    write("mpm", 2.0, "diverged")
    assert bisect.next_round(wanted, tmp_path / "runs", files(tmp_path)) == ["method=mpm cfl=1.25"]
    write("mpm", 1.25, "broke_down")
    write("mpm", 1.6, "ok")  # beyond the first failure: no end of the interval
    assert bisect.next_round(wanted, tmp_path / "runs", files(tmp_path)) == ["method=mpm cfl=0.875"]
    write("mpm", 1.2, "ok")
    assert bisect.next_round(wanted, tmp_path / "runs", files(tmp_path)) == []
    assert bisect.asked_for(EXPERIMENTS / "fig6.yaml") is None


def test_stability_table_reads_the_bracket(tmp_path, write_run):
    for cfl, status in ((0.5, "ok"), (0.99, "ok"), (1.01, "diverged"), (2.0, "diverged")):
        folder, step = tmp_path / "stability", cfl * 1e-3
        path = write_run(
            folder, "mpm", resolution=16, status=status, time_step=step, snapshot=False
        )
        with edited(path) as data:
            data.config = json.dumps(json.loads(data.config) | {"cfl": cfl})
    row = survival.stability_table(read_campaigns(tmp_path)["stability"]).rows[0]
    limit = 1e-3 * survival.WAVE_SPEED * 16
    assert [row[k].value for k in (2, 4, 5)] == pytest.approx([limit, 0.99 * limit, 1.01 * limit])
    assert row[6].value == pytest.approx(1.0) and len(row[6].files) == 2
    assert row[3].value == pytest.approx(np.sqrt(0.6)) and row[7].value == pytest.approx(
        limit / np.sqrt(0.6)
    )


def test_limits_on_an_infinite_grid():
    assert spectra.largest_step(1, "consistent", "flip") == pytest.approx(1.0 / np.sqrt(3.0))
    assert spectra.largest_step(2, "consistent", "flip") == pytest.approx(2.0 / np.sqrt(10.0))
    for degree in (1, 2, 3):
        for transfer in ("flip", "position_difference"):
            assert spectra.largest_step(degree, "lumped", transfer) > spectra.largest_step(
                degree, "consistent", "flip"
            )


@pytest.mark.parametrize("transfer", ["flip", "position_difference"])
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.slow  # the limits are asked by tests/core/test_limits.py
def test_the_solver_meets_the_limits_on_an_infinite_grid(mass, transfer):
    case = {
        "method__mass": mass,
        "method__transfer": transfer,
        "resolution": 64,
        "problem__velocity_amplitude": 0.006,
    }
    limit = spectra.largest_step(1, mass, transfer) / 64 / survival.WAVE_SPEED
    ends = []
    for factor in (0.97, 1.05):
        config = support.compose(
            "bar_fixed_ends", "mpm", "linear", time_step=factor * limit, end_time=0.2, **case
        )
        ends.append(solve(config).attrs["status"])
    assert ends == ["ok", "diverged"]


def test_files_of_an_earlier_version_are_left_out(tmp_path, write_run):
    kept = write_run(tmp_path / "bar", "mpm", resolution=8)
    write_run(tmp_path / "bar", "mpm", resolution=8, settings={"basis": {"old_key": 1}})
    assert len(read_campaigns(tmp_path)["bar"].runs) == 2
    completion.write(tmp_path / "bar", "inputs", {kept.name})
    assert list(read_campaigns(tmp_path)["bar"].runs.index) == [f"bar/{kept.name}"]
