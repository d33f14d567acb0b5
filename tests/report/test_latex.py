"""Tables in LaTeX: numbers on their points, words as words, nothing that LaTeX would take for its own."""

import shutil
import subprocess

import pytest

from mpmbench.report import build
from mpmbench.report.tables import Table

ROWS = [
    ["a_1 & 50 %", 1.7031e-6, "diverged"],
    ["#2 {x} \\y ^~$", -0.5, 12.0],
    ["µ ± 2² <b>|*", "", 1.0],
]


def table(rows=ROWS):
    return Table(
        "x-errors", "Errors [m]", ["curve", "8 cells", "8 cells"], rows, "Medians of 3 %.", (1, 2)
    )


def test_numbers_stand_on_their_points_and_words_are_words():
    text = table().latex()
    assert r"\begin{tabular}{lS[table-format=-1.2e-1]S[table-format=2.0]}" in text
    assert r"a\_1 \& 50 \% & 1.70e-06 & {diverged} \\" in text
    assert r"\#2 \{x\} \textbackslash{}y \^{}\textasciitilde{}\$ & -0.5 & 12 \\" in text
    assert r"& {} & 1 \\" in text, "a number that is missing is an empty word"
    assert r"{curve} & {8 cells} & {8 cells} \\" in text
    assert r"\caption{Errors [m]}" in text and r"\label{tab:x-errors}" in text
    assert r"Medians of 3 \%." in text.split(r"\end{tabular}")[1].split(r"\end{table}")[0]
    assert "booktabs, siunitx" in text.splitlines()[0]


def test_a_column_without_numbers_is_text_and_long_text_has_lines():
    text = table([["short", "broke down", "so " * 30]]).latex()
    assert r"\begin{tabular}{llp{6cm}}" in text and "{broke down}" not in text


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("pdflatex"), reason="needs pdflatex with siunitx")
def test_all_tables_of_a_report_compile(tmp_path):
    from .conftest import make_quickstart

    folder = tmp_path / "quickstart"
    make_quickstart(folder)
    build(folder)
    tables = folder / "report" / "tables"
    (tables / "hostile.tex").write_text(table().latex(), encoding="utf-8")
    names = sorted(file.name for file in tables.glob("*.tex"))
    assert len(names) > 6
    head = r"\documentclass{article}\usepackage[T1]{fontenc}\usepackage{booktabs,siunitx}\begin{document}"
    parts = "\n".join(rf"\input{{{name}}} See~\ref{{tab:x-errors}}.\clearpage" for name in names)
    (tables / "all.tex").write_text(f"{head}\n{parts}\n\\end{{document}}\n", encoding="utf-8")
    command = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "all.tex"]
    done = subprocess.run(command, cwd=tables, capture_output=True, timeout=300)
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-1500:]
    assert (tables / "all.pdf").stat().st_size > 10_000
