"""Result files from elsewhere: what they say cannot run, leave the report's folder or break it."""

import re
from html.parser import HTMLParser

import pytest

from mpmbench.cli import main
from mpmbench.report import build
from mpmbench.report.names import anchor, drawn, safe_name
from mpmbench.report.tables import Table
from mpmbench.report.writer import Writer
from tests.support import unbroken

NAN = float("nan")
BARE = {"snapshot": False, "scalars": {"error_displacement_rms": NAN, "error_stress_rms": NAN}}
ATTACK = 'x"><img src=q onerror="document.title=1"><script>document.title=1</script>'
ELEMENTS = {  # that a page of ours is made of; "image" stands for pixels within a figure
    *(
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "main",
        "section",
        "div",
        "p",
        "span",
        "br",
        "nav",
        "header",
    ),
    *("h1", "h2", "h3", "ul", "li", "dl", "dt", "dd", "code", "a", "blockquote", "details"),
    *("summary", "table", "thead", "tbody", "tr", "th", "td", "figure", "figcaption"),
    *("svg", "g", "defs", "path", "use", "clippath", "rect", "image", "text", "tspan"),
    *("script", "output", "button"),
}
LINK = re.compile(r"#[A-Za-z0-9_./-]+|(figures|tables)/[A-Za-z0-9_%.-]+|data:image/png;base64,.*")


class Page(HTMLParser):
    """The elements of a page and their attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: set[str] = set()
        self.attributes: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.add(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def of(self, *names: str) -> list[str]:
        return [value for name, value in self.attributes if name in names]


def assert_harmless(text: str) -> None:
    page = Page(text)
    assert page.elements <= ELEMENTS
    assert not [name for name, _ in page.attributes if name.startswith("on")]
    assert [link for link in page.of("href", "xlink:href", "src") if not LINK.fullmatch(link)] == []
    assert all(re.fullmatch(r"[A-Za-z0-9_./-]+", name) for name in page.of("id"))
    assert all(re.fullmatch(r"#[\w-]+", name) for name in re.findall(r"url\(([^)]*)\)", text))


@pytest.mark.parametrize(
    "text", ("a b", "../../x", "", "ü", 'a"b', "a.b", "a\n", "x" * 81, "\udc80")
)
def test_a_name_that_is_not_plain_becomes_a_hash(text):
    assert re.fullmatch(r"x[0-9a-f]{16}", safe_name(text))
    assert safe_name(text) != safe_name(f"{text}.")


def test_plain_names_stay():
    for name in ("bar_fixed_ends", "A-1", "x" * 80):
        assert safe_name(name) == name
    assert anchor("fig6/mpm-linear-bar-n8-0a1b.nc") == "fig6/mpm-linear-bar-n8-0a1b.nc"
    assert anchor("a b/c.nc") == f"{safe_name('a b')}/c.nc"


def test_a_figure_shows_dollar_signs_and_no_control_characters():
    assert drawn("$\\frac{$ \x1b[31m\u202e") == "\\$\\frac{\\$ \ufffd[31m\ufffd"
    assert drawn("position x_1 [m]") == "position x_1 [m]"
    assert drawn("error [kg/m^2], [m^1.5/s]") == "error [kg/m$^{2}$], [m$^{1.5}$/s]"
    assert drawn("a" * 300) == "a" * 300 and drawn("a" * 301) == "a" * 299 + "…"


@pytest.mark.usefixtures("only_svg")
def test_a_problem_cannot_leave_the_folder_of_the_report(tmp_path, write_run):
    (tmp_path / "a/b/results").mkdir(parents=True)
    file = write_run(
        tmp_path / "a/b/results", problem="../../../x", file=tmp_path / "a/b/results/x.nc", **BARE
    )
    build(tmp_path / "a/b/results")
    found = {path for path in tmp_path.rglob("*") if path.is_file() and path != file}
    assert found and all(path.is_relative_to(tmp_path / "a/b/results/report") for path in found)
    assert (tmp_path / f"a/b/results/report/tables/{safe_name('../../../x')}-runs.csv") in found


@pytest.mark.usefixtures("only_svg")
def test_names_and_keys_from_a_file_cannot_break_out_of_the_page(tmp_path, write_run):
    for value in (1.0, 2.0):
        write_run(
            tmp_path, problem=ATTACK, method=ATTACK, basis=f"{ATTACK}$", snapshot=False,
            settings={"problem": {ATTACK: value}}, file=tmp_path / f"{value}'\"><b>.nc",
        )  # fmt: skip
    write_run(tmp_path, status="crashed", reason=ATTACK, file=tmp_path / f"{'<b>' * 9}%41.nc")
    text = build(tmp_path).read_text()
    assert_harmless(text)
    policies = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]+)">', text)
    assert len(policies) == 1 and policies[0].startswith("default-src 'none';")
    (allowed,) = re.findall(r"script-src ([^;]*);", policies[0])
    assert re.fullmatch(r"'sha256-[A-Za-z0-9+/=]+'", allowed), "no script but that of the page"
    assert re.findall(r"<script", text) == ["<script"]


@pytest.mark.parametrize("name", ("../x", "figures/../../x", "/tmp/x", "link/x"))
def test_nothing_is_written_outside_of_the_report(tmp_path, name):
    (tmp_path / "report").mkdir()
    (tmp_path / "report/link").symlink_to(tmp_path)
    with pytest.raises(PermissionError, match="lies outside of"):
        Writer(tmp_path / "report").text(name, "content")
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_a_report_folder_that_is_a_link_to_elsewhere_is_refused(tmp_path, write_run):
    write_run(tmp_path / "results", **BARE)
    (tmp_path / "other").mkdir()
    (tmp_path / "results/report").symlink_to(tmp_path / "other")
    with pytest.raises(PermissionError, match="lies outside of"):
        build(tmp_path / "results")
    assert list((tmp_path / "other").iterdir()) == []
    Writer(tmp_path / "results/report").text("index.html", "")  # the user's own wish
    assert (tmp_path / "other/index.html").is_file()


def test_a_list_of_files_removes_none_outside_and_no_folder(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    report = tmp_path / "report"
    (report / "kept").mkdir(parents=True)
    (report / "old.md").write_text("old")
    (report / "link.md").symlink_to(tmp_path / "mine.txt")
    names = ["../mine.txt", "link.md", str(tmp_path / "mine.txt"), "kept", "", ".", "old.md"]
    (report / "files.txt").write_bytes("\n".join(names).encode() + b"\n\xff")
    Writer(report).finish()
    assert (tmp_path / "mine.txt").read_text() == "mine" and (report / "kept").is_dir()
    assert not (report / "old.md").exists()


@pytest.mark.usefixtures("only_svg")
def test_folders_of_the_user_keep_their_names(tmp_path, write_run):
    folder = tmp_path / "Ergebnisse für Ötztal v1.2"
    write_run(folder, **BARE)
    page = build(folder)
    assert page == folder / "report/index.html"
    assert "<h1>Ergebnisse für Ötztal v1.2</h1>" in page.read_text(encoding="utf-8")


def test_markdown_holds_no_element_of_a_file():
    cell = f"{ATTACK}\n\n# a | [b](javascript:c)"
    text = Table("name", ATTACK, [cell], [[cell]], note=ATTACK).markdown()
    assert "<" not in text and "](" not in text and "\n# a" not in text
    assert text.count("&lt;script>") == 4


def test_reasons_of_files_are_listed_in_one_line_each(tmp_path, write_run, capsys):
    reason = "a\x1b[2J\nfresh      mine: ok\u202e"
    file = write_run(tmp_path, status="interrupted", reason=reason, snapshot=False)
    assert main(["status", str(tmp_path)]) == 0
    _, *lines = capsys.readouterr().out.rstrip("\n").split("\n")
    (line,) = unbroken("\n".join(lines)).split("\n")  # what is said of a file stands further in
    assert file.stem in line and "a\\x1b[2J fresh" in line and line.isprintable()
