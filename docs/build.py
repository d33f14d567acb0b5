"""Builds the documentation, offline: ``python docs/build.py`` leaves ``docs/_build/html/index.html``.

The reference is made from the declarations in the sources, and the gallery by running every problem
and every example, each result drawn by `show` and `animate`. What was run before is kept in
``docs/_build/results``. The exit code is 1 when Sphinx warns, a link leads nowhere, or a problem has no
picture. With ``--quick`` one problem is run and the gallery shows those
that were run before: for a look at the text.
"""

import argparse
import contextlib
import io
import os
import runpy
import shutil
import subprocess
import sys
import tempfile
from html.parser import HTMLParser
from inspect import isfunction
from pathlib import Path
from typing import Any, get_origin
from urllib.parse import unquote, urlsplit

DOCS = Path(__file__).resolve().parent
ROOT, BUILD = DOCS.parent, DOCS / "_build"
SOURCE, HTML, RESULTS = BUILD / "source", BUILD / "html", BUILD / "results"
sys.path.insert(0, str(ROOT))

from PIL import Image  # noqa: E402

from mpmbench import NAMES, cli  # noqa: E402
from mpmbench.commands import compare  # noqa: E402
from mpmbench.commands.help import lines_of  # noqa: E402
from mpmbench.commands.list import sentences_of  # noqa: E402
from mpmbench.commands.verbs import VERBS  # noqa: E402
from mpmbench.report.notebook import Result  # noqa: E402
from mpmbench.report.picture import rendered  # noqa: E402
from mpmbench.report.picture import sheet as contact_sheet  # noqa: E402
from mpmbench.results import layout, netcdf  # noqa: E402
from mpmbench.settings.schema import GROUPS, declared, description, options  # noqa: E402
from mpmbench.settings.words import about, in_yaml  # noqa: E402

EXIT_CODES = {
    0: "all runs are fine; of `compare`: nothing is worse or undecided",
    1: "some run failed, or something could not be written",
    2: "bad input, named in one sentence before anything runs",
    compare.SLOWER: "`compare`: slower",
    compare.LESS_ACCURATE: "`compare`: less accurate, or of lower order",
    compare.NEW_FAILURES: "`compare`: new failures",
    compare.NOT_COMPARABLE: "`compare`: not comparable, and in which keys the campaigns differ",
    compare.UNDECIDED: "`compare`: whether it is slower cannot be said",
}


# What the gallery runs of problems that take minutes.
CHOICES = {
    "six_cubes": "resolution=4",
    "soil_column": "resolution=20",
    "sphere_impact": "resolution=2 end_time=2e-6",
    "taylor_anvil": "resolution=2 end_time=2e-5",
}
INSTANTS = "snapshots=8"  # that moving pictures show


def table(head: list[str], rows: list[list[object]]) -> list[str]:
    """A table in Markdown."""
    cells = [[str(cell).replace("|", "\\|") for cell in row] for row in rows]
    return ["", *(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *cells]), ""]


def keys() -> list[str]:
    """All keys, from their declarations."""
    config = (ROOT / "conf" / "config.yaml").read_text(encoding="utf-8")
    general = config.split("# The discretisation\n")[1].split("\n# For experiments")[0]
    page = ["# Keys", "", "## Of every run", "", "```yaml", *general.strip().splitlines(), "```"]
    for group in GROUPS:
        page += ["", f"## {group}"]
        for option in options(group):
            page += ["", f"### {group}={option}", "", description(group, option)]
            rows: list[list[object]] = [
                [f"`{group}.{key}`", f"`{in_yaml(one.default)}`", about(one)]
                for key, one in declared(group, option).items()
            ]
            page += (
                table(["key", "default", "[unit] what it is (what is allowed)"], rows)
                if rows
                else []
            )
    transfers = sentences_of("transfers").items()
    rows = [[f"`{name}`", said] for name, said in transfers]
    return [*page, "", "## Values of method.transfer", *table(["transfer", "what it is"], rows)]


def commands() -> list[str]:
    """The help of every command."""
    page = ["# Commands", ""]
    for verb, said in VERBS.items():
        page += [f"## {verb}", "", "```text", *lines_of(verb, *said), "```", ""]
    return page


def exit_codes() -> list[str]:
    """What a command says by its exit code."""
    rows: list[list[object]] = [[code, said] for code, said in EXIT_CODES.items()]
    return ["# Exit codes", *table(["code", "meaning"], rows)]


def file_format(result: Path) -> list[str]:
    """Attributes and variables of a result file, from what is checked of it, and from one that was run."""
    named = {**layout.ATTRIBUTES, **layout.OPTIONAL}
    said: list[list[object]] = [[f"`{name}`", kind[1]] for name, kind in named.items()]
    dataset = netcdf.load(result)
    rows: list[list[object]] = [
        [
            f"`{name}`",
            ", ".join(map(str, one.dims)),
            one.attrs.get("units", ""),
            one.attrs.get("long_name", ""),
        ]
        for name, one in dataset.variables.items()
    ]
    return [
        "# The result file",
        "",
        "netCDF 4, one file for each run, in SI units. The variable `digest` is the SHA-256 of all other bytes; "
        "`end_state` and `end_state_places` are what `continue` goes on from.",
        "",
        "## Attributes",
        "",
        "These are checked whenever a file is read; versions and the machine stand beside them.",
        *table(["attribute", "what it has to be"], said),
        f"## Variables of `{result.stem}`",
        "",
        "Problems, bases and materials add their own.",
        *table(["variable", "dimensions", "unit", "what it is"], rows),
    ]


def api() -> list[str]:
    """The public names of Python, by the module in which they stand."""
    page = ["# Python", "", "All of these are imported from `mpmbench` itself.", ""]
    import mpmbench

    for module, names in NAMES.items():
        page += [f"## {module}", "", "```{eval-rst}"]
        for name in names.split():
            thing = getattr(mpmbench, name)
            kind = (
                "class" if isinstance(thing, type) else "function" if isfunction(thing) else "data"
            )
            automatic = "py:data" if get_origin(thing) is dict else f"auto{kind}"
            page += [f".. {automatic}:: mpmbench.{module}.{name}", ""]
        page += ["```", ""]
    return page


def run_problems(quick: bool) -> dict[str, Path]:
    """Every problem, and its result file; what was run before is kept."""
    usual = ",".join(name for name in options("problem") if name not in CHOICES)
    sweeps = [words_of(one).split() for one in (usual, *CHOICES)]
    for words in [words_of("bar_fixed_ends").split()] if quick else sweeps:
        command = [
            sys.executable,
            "-m",
            "mpmbench",
            "-m",
            *words,
            "campaign=gallery",
            "report=false",
        ]
        subprocess.run(
            [*command, f"output_dir={RESULTS}", "limits.time=120"], cwd=ROOT, check=False
        )
    found = {}
    for file in sorted((RESULTS / "gallery").glob("*.nc")):
        attributes = netcdf.read_attributes(file)
        if attributes["status"] == "ok":
            found[attributes["problem"]] = file
    return found


def words_of(problem: str) -> str:
    """The words with which the gallery runs a problem."""
    return " ".join(filter(None, [f"problem={problem}", CHOICES.get(problem), INSTANTS]))


def drawn(command: str, result: Path, target: Path) -> bool:
    """Have `show` or `animate` draw a result; whether it could."""
    with contextlib.redirect_stdout(io.StringIO()):
        return cli.main([command, str(result), f"--out={target}"]) == 0


def halfway(film: Path) -> bytes:
    """The picture in the middle of a moving one, as PNG."""
    file = io.BytesIO()
    with Image.open(film) as moving:
        moving.seek(moving.n_frames // 2)
        moving.convert("RGB").save(file, "PNG")
    return file.getvalue()


def gallery(found: dict[str, Path]) -> tuple[list[str], list[str]]:
    """Contact sheets of `show` and `animate` on every problem, and the examples with what they print.

    Returns the page, and the problems that have no picture.
    """
    pictures = SOURCE / "pictures"
    pictures.mkdir()
    stills: dict[str, bytes] = {}
    films: dict[str, bytes] = {}
    sheet = []
    for name in options("problem"):
        still, film = pictures / f"{name}.png", pictures / f"{name}.gif"
        sheet += [f"## {name}", "", description("problem", name), ""]
        sheet += ["```text", f"python -m mpmbench {words_of(name)}", "```", ""]
        if not (
            name in found
            and drawn("show", found[name], still)
            and drawn("animate", found[name], film)
        ):
            sheet += ["It has no picture, since it was not run to its end.", ""]
            continue
        stills[name], films[name] = still.read_bytes(), halfway(film)
        sheet += [f"![Particles of {name} at the end]({still.relative_to(SOURCE)})", ""]
        sheet += [f"{{download}}`The same, moving <{film.relative_to(SOURCE)}>`", ""]
    head = ["# Gallery", "", "`show` on a run of every problem; below, each by itself.", ""]
    for kind, images in (("show", stills), ("animate", films)):
        file = pictures / f"contact_sheet_{kind}.png"
        file.write_bytes(contact_sheet([*images.values()]))
        head += [f"![{', '.join(images)}]({file.relative_to(SOURCE)})", ""]
        head += ["`animate` on the same runs, halfway through.", ""] if kind == "show" else []
    sheet = [*head, *sheet, "## Examples", ""]
    for example in sorted((ROOT / "examples").glob("*.py")):
        text = example.read_text(encoding="utf-8")
        sheet += [f"### {example.stem}", "", "```python", text.rstrip(), "```", "", "prints", ""]
        printed, names = outcome_of(example)
        sheet += ["```text", printed, "```", ""]
        for result in [one for one in names.values() if isinstance(one, Result)][-1:]:
            picture = pictures / f"example-{example.stem}.png"
            picture.write_bytes(rendered(result.show()))
            words = f"Particles of the last result of {example.stem}"
            sheet += [
                "and its last result shows",
                "",
                f"![{words}]({picture.relative_to(SOURCE)})",
                "",
            ]
    return sheet, [name for name in options("problem") if name not in stills]


def outcome_of(example: Path) -> tuple[str, dict[str, Any]]:
    """What an example prints, run in an empty folder, and its names."""
    before, out = Path.cwd(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            with contextlib.redirect_stdout(out):
                names = runpy.run_path(str(example))
        finally:
            os.chdir(before)
    return out.getvalue().rstrip(), names


def take_reports() -> None:
    """Put the reports into the site: with their figures and tables, each a page."""
    shutil.copytree(ROOT / "reports", SOURCE / "reports")
    for page in sorted((SOURCE / "reports").rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        if not text.startswith("# "):
            text = f"# {page.stem.capitalize()}\n\n{text}"
        below = [one.relative_to(page.parent) for one in sorted(page.parent.glob("*/*.md"))]
        if below:
            listed = "\n".join(map(str, below))
            text += f"\n```{{toctree}}\n:hidden:\n{listed}\n```\n"
        page.write_text(text, encoding="utf-8")


class Links(HTMLParser):
    """Targets of links and pictures in a page, and the places in it that can be linked to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.anchors |= {str(found[key]) for key in ("id", "name") if found.get(key)}
        self.targets += [str(found[key]) for key in ("href", "src") if found.get(key)]


def broken_links(folder: Path) -> list[str]:
    """Links in a folder of pages that lead to no file or place; addresses elsewhere are not asked for."""
    ours = (page for page in sorted(folder.rglob("*.html")) if "_static" not in page.parts)
    pages = {page: Links(page) for page in ours}
    broken = []
    for page, links in pages.items():
        for target in links.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            file = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            place = unquote(parts.fragment)
            if not file.exists() or (place and file in pages and place not in pages[file].anchors):
                broken.append(f"{page.relative_to(folder)}: {target}")
    return broken


def main() -> int:
    """Write the sources, build the pages, check the links; returns the exit code."""
    parser = argparse.ArgumentParser(description="Build the documentation, offline.")
    parser.add_argument(
        "--quick", action="store_true", help="run one problem, for a look at the text"
    )
    quick = parser.parse_args().quick
    found = run_problems(quick)
    shutil.rmtree(SOURCE, ignore_errors=True)
    shutil.copytree(
        DOCS, SOURCE, ignore=shutil.ignore_patterns("_build", "build.py", "__pycache__")
    )
    take_reports()
    sheet, undrawn = gallery(found)
    pages = {
        "reference/keys": keys(),
        "reference/commands": commands(),
        "reference/exit_codes": exit_codes(),
        "reference/file": file_format(found["bar_fixed_ends"]),
        "reference/api": api(),
        "gallery": sheet,
    }
    for name, lines in pages.items():
        (SOURCE / f"{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    shutil.rmtree(HTML, ignore_errors=True)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    code = subprocess.run([*command, str(SOURCE), str(HTML)], cwd=ROOT).returncode
    broken = broken_links(HTML) if HTML.exists() else []
    told = [f"broken: {one}" for one in broken] + [f"no picture of: {one}" for one in undrawn]
    print(*told, sep="\n", end="\n" if told else "")
    print(
        f"{HTML / 'index.html'}: {len(list(HTML.rglob('*.html')))} pages, {len(broken)} broken links"
    )
    return 1 if code or broken or (undrawn and not quick) else 0


if __name__ == "__main__":
    sys.exit(main())
