"""Writes the report of a paper: a page that opens offline, and a README with all of it."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import quote as quoted

from mpmbench.analysis.convergence import INTERVAL_MEANING
from mpmbench.papers.find import find
from mpmbench.papers.kit import Campaigns, Chapter, Paper, read_campaigns
from mpmbench.report import style, tables
from mpmbench.report.claims import OPEN, PARTLY, UNDECIDED, claims_table, set_ups_table
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.names import safe_name
from mpmbench.report.page import facts, template
from mpmbench.report.series import studies
from mpmbench.report.tables import Table
from mpmbench.report.writer import Picture, Writer

NOT_COMMITTED = "index.html\nfiles.txt\nfigures/*.pdf\nfigures/*.png\ntables/*.md\n"


def build(name: str, results: Path = Path("results"), output: Path | None = None) -> Path:
    """Write the report of a paper and return its page.

    Parameters
    ----------
    name : str
        Name of a paper (`names`).
    results : Path
        Folder with ``<name>/<experiment>/*.nc``.
    output : Path, optional
        Where the report goes; ``reports/<name>`` by default.

    Returns
    -------
    Path
        ``index.html``; README.md, the figures and the tables are beside it.

    Raises
    ------
    KeyError
        When there is no such paper.
    FileNotFoundError
        When there is no result file.
    """
    paper = find(name)
    folder = Path(results) / name
    campaigns = read_campaigns(folder)
    if not campaigns:
        command = f"python -m mpmbench reproduce {name}"
        raise FileNotFoundError(f"{folder} has no result files (*.nc); `{command}` makes them")
    writer = Writer(Path(output) if output is not None else Path("reports") / name)
    verdicts = claims_table("claims", paper.claims, campaigns, paper.set_ups)
    set_ups = set_ups_table("set-ups", paper.claims, campaigns, paper.set_ups)
    for table in filter(None, (verdicts, set_ups)):
        writer.table(table)
    with style.applied():
        chapters = [_chapter(make, campaigns) for make in paper.chapters]
        pictures = {chapter.name: _written(writer, chapter) for chapter in chapters}
    lists = {experiment: list(_runs(campaigns, experiment)) for experiment in campaigns}
    for group in lists.values():
        for table in group:
            writer.text(f"tables/{table.name}.csv", table.csv())
    writer.text(".gitignore", NOT_COMMITTED)
    writer.text("README.md", markdown(paper, (verdicts, set_ups), chapters, lists))
    html = template("papers/page.html.jinja").render(
        paper=paper,
        claims=verdicts,
        set_ups=set_ups,
        partly=PARTLY,
        open=(OPEN, UNDECIDED),
        chapters=chapters,
        pictures=pictures,
        lists=lists,
        **facts(campaigns.values()),
    )
    page = writer.text("index.html", html)
    writer.finish()
    return page


def _written(writer: Writer, chapter: Chapter) -> list[Picture]:
    """Write what a chapter has; its pictures, as the page takes them."""
    for animation in chapter.animations:
        writer.data(f"figures/{animation.name}.gif", animation.content)
    for table in chapter.tables:
        writer.table(table)
    return [
        writer.picture(one.name, one.title, one.caption, one.content) for one in chapter.drawings
    ]


def _chapter(make: Any, campaigns: Campaigns) -> Chapter:
    """The chapter, or one that says which runs it lacks."""
    try:
        chapter: Chapter = make(campaigns)
    except MissingRuns as missing:
        name = make.__name__.removesuffix("_chapter")
        return Chapter(
            name,
            name.replace("_", " "),
            notes=[f"This chapter has to wait for its runs: {missing}."],
        )
    return chapter


def _runs(campaigns: Campaigns, experiment: str) -> Iterable[Table]:
    """All runs of an experiment with their files, one table for each problem."""
    for study in studies(campaigns[experiment]):
        table = tables.all_runs(study)
        where = experiment.replace("/", "-")
        title = f"{experiment}: {study.problem.replace('_', ' ')}, {len(study.runs)} runs"
        yield dataclasses.replace(
            table, name=f"{where}-{safe_name(study.problem)}-runs", title=title
        )


def markdown(
    paper: Paper,
    verdicts: tuple[Table, Table],
    chapters: list[Chapter],
    lists: dict[str, list[Table]],
) -> str:
    """The report as Markdown; its links lead to tables with all digits and result files.

    `verdicts` are the table of the claims and that of the set-ups.
    """
    parts = [f"# {paper.title}", paper.reference, paper.summary]
    parts.append(
        f"Written by `python -m mpmbench reproduce {paper.name}` from result files; nothing in it "
        "is typed in. The CSV files beside it hold all digits and name the result files behind "
        "each row."
    )
    claims, set_ups = verdicts
    if claims:
        rows: list[list[Any]] = []
        for statement, source, answer, because, threshold, quote, _ in claims.rows:
            said = f"{statement.text} ({source.text})"
            said += f": *“{quote.text}”*" if quote.text else ""
            rows.append([said, answer, because, threshold])
        short = Table("claims", "", ["claim", "verdict", "because", "threshold"], rows)
        parts += ["## Claims", paper.stated, short.markdown().strip()]
        parts.append("[Evidence and result files](tables/claims.csv)")
    if set_ups:
        title = f"**{set_ups.title}** ([CSV](tables/{set_ups.name}.csv))"
        parts.append(dataclasses.replace(set_ups, title=title).markdown().strip())
    for chapter in chapters:
        parts.append(f"## {chapter.title}")
        if chapter.statement:
            parts.append("\n".join(f"> {line}" for line in chapter.statement.splitlines()))
        kinds = {"svg": chapter.drawings, "gif": chapter.animations}
        for suffix, drawings in kinds.items():
            for one in drawings:
                image = f"![{one.title}](figures/{one.name}.{suffix})"
                parts.append(f"{image}\n\n*{one.title}.* {one.caption}".strip())
        parts += chapter.notes
        for table in chapter.tables:
            title = f"**{table.title}** ([CSV](tables/{table.name}.csv))"
            parts.append(dataclasses.replace(table, title=title).markdown().strip())
    links = [
        f"- [{table.title}](tables/{quoted(table.name)}.csv)"
        for group in lists.values()
        for table in group
    ]
    parts += ["## All runs", "\n".join(links), f"Intervals: {INTERVAL_MEANING}"]
    return "\n\n".join(part for part in parts if part) + "\n"
