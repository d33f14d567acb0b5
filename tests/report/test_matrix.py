"""Everything against everything: equal cost, reasons, sentences, and the choice of the cheapest run."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpmbench.report import front, matrix_pages, page
from mpmbench.report.front import quantity_of
from mpmbench.results.records import read_campaign

PROBLEMS = ("bar_fixed_ends", "patch_test", "rigid_motion")
# method: error and time of a coarse and of a fine run [m], [s]
RUNS = {
    "mpm": ((1e-2, 1.0), (8e-3, 4.0)),
    "otm": ((4e-3, 3.0), (1e-3, 30.0)),
    "gmm": ((5e-3, 9.0),),
}


@pytest.fixture
def campaign(tmp_path: Path, write_run: Any) -> Path:
    """Three methods on three problems, and one that fails; on the second problem errors are twice as large."""
    law = {"material": {"name": "small_strain_elastic"}}
    for number, problem in enumerate(PROBLEMS):
        for method, runs in RUNS.items():
            for resolution, (error, seconds) in zip((8, 16), runs, strict=False):
                scalars = {
                    "error_displacement_rms": error * (1 + number % 2),
                    "solver_time": seconds,
                }
                write_run(
                    tmp_path, method, "linear", resolution, problem, scalars=scalars, settings=law
                )
        write_run(
            tmp_path, "unified", "linear", 8, problem, status="broke_down", reason="it parted"
        )
    return tmp_path


def test_errors_are_compared_at_equal_cost(campaign: Path) -> None:
    """By 9 s all three have a result: mpm its fine one, otm its coarse one, which is the best."""
    fields = front.fields_of(read_campaign(campaign))
    assert [field.problem for field in fields] == sorted(PROBLEMS)
    assert fields[0].cost == 9.0
    found = fields[0].entries()
    assert [found[name].error for name in ("MPM, linear", "OTM, linear", "GMM, linear")] == [
        8e-3,
        4e-3,
        5e-3,
    ]
    assert found["MPM, linear"].ratio == pytest.approx(2.0)
    assert found["OTM, linear"].ratio == 1.0
    broken = found["unified, linear"]
    assert (broken.status, broken.reason) == ("broke_down", "it parted") and np.isnan(broken.ratio)


def test_the_sentence_names_who_is_best_up_to_which_cost(campaign: Path) -> None:
    """The runs that no cheaper one equals are mpm at 1 s and otm at 3 and 30 s."""
    field = front.fields_of(read_campaign(campaign))[0]
    assert [step[1] for step in field.front()] == [1.0, 3.0, 30.0]
    assert field.sentence() == (
        "MPM, linear is best up to 3 s; OTM, linear beyond. The smallest displacement error is 0.001 m, in 30 s."
    )


def test_a_sentence_names_a_few_turns(tmp_path: Path, write_run: Any) -> None:
    order = [(n, name) for n in (8, 16, 32) for name in ("mpm", "otm")]
    for k, (resolution, name) in enumerate(order):
        scalars = {"error_displacement_rms": 0.5**k, "solver_time": k + 1.0}
        write_run(tmp_path, name, "linear", resolution, scalars=scalars)
    (field,) = front.fields_of(read_campaign(tmp_path))
    assert field.sentence() == (
        "MPM, linear is best up to 2 s; OTM, linear up to 3 s; others up to 6 s; OTM, linear beyond. "
        "The smallest displacement error is 0.0312 m, in 6 s."
    )


@pytest.mark.usefixtures("only_svg")
def test_pages_have_every_cell(campaign: Path, tmp_path: Path) -> None:
    read = read_campaign(campaign)
    written = matrix_pages.write(read, tmp_path / "pages")
    whole, which = (file.read_text("utf-8") for file in written)
    assert "18 runs: 3 broke down, 15 ok." in whole and "heat_map.svg" in whole
    table = (tmp_path / "pages/matrix/tables/matrix.csv").read_text("utf-8")
    assert table.count("it parted") == 3 and table.count("\n") == 1 + 4 * 3
    assert "Small strain" in which and "- broke down: unified, linear" in which
    assert "The stored runs have no problem of this kind." in which
    assert (tmp_path / "pages/matrix/figures/heat_map.svg").is_file()


@pytest.mark.slow
def test_the_report_begins_with_all_problems(campaign: Path, tmp_path: Path) -> None:
    text = page.build(campaign, tmp_path / "report").read_text("utf-8")
    assert "Everything against everything" in text and "OTM, linear beyond" in text


def test_choose_takes_the_cheapest_run_that_is_good_enough(
    campaign: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from mpmbench.cli import main

    where = [f"results={campaign}"]
    assert main(["choose", "problem=bar_fixed_ends", "error=6e-3", *where]) == 0
    said = capsys.readouterr().out
    assert "OTM, linear" in said and "3 s" in said and "python -m mpmbench" in said
    assert "method=otm" in said and "resolution=8" in said
    assert main(["choose", "problem=bar_fixed_ends", "error=1e-9", *where]) == 1
    assert "no stored run is good enough; the best is OTM, linear" in capsys.readouterr().out
    for wrong, sentence in (
        (["choose"], "problem=NAME error=NUMBER is needed"),
        (["choose", "problem=nothing", "error=1", *where], "there are bar_fixed_ends"),
        (["choose", "problem=patch_test", "error=-1", *where], "greater than 0"),
    ):
        assert main(wrong) == 2
        assert sentence in capsys.readouterr().err


def test_runs_are_compared_by_displacements_or_by_what_most_of_them_have() -> None:
    """An error of the problem's own comes before those of other fields, which are better than none."""
    runs = pd.DataFrame({"error_stress_rms": [1.0, 2.0], "error_own": [1.0, np.nan]})
    assert quantity_of(runs) == "error_own"
    assert quantity_of(runs.drop(columns="error_own")) == "error_stress_rms"
    assert (
        quantity_of(runs.assign(error_displacement_rms=[np.nan, 1.0])) == "error_displacement_rms"
    )
    assert quantity_of(pd.DataFrame({"steps": [1.0]})) is None
