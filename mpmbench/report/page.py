"""The report of a campaign: figures and tables, and all of it on one page that opens offline."""

import base64
import hashlib
import json
import re
from collections import Counter
from collections.abc import Collection
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import markupsafe

from mpmbench.analysis.convergence import INTERVAL_MEANING
from mpmbench.report import style
from mpmbench.report.findings import times
from mpmbench.report.names import anchor
from mpmbench.report.sections import Section, fitted, sections_of
from mpmbench.report.writer import Writer
from mpmbench.results.netcdf import unverified
from mpmbench.results.records import Campaign, read_campaign


def build(results: Path, output: Path | None = None) -> Path:
    """Write the report of a campaign and return its page.

    Parameters
    ----------
    results : Path
        Folder of result files.
    output : Path, optional
        Where the report goes; ``<results>/report`` by default.

    Returns
    -------
    Path
        ``index.html``; figures (SVG, PDF, PNG) and tables (CSV, Markdown, LaTeX) are in the folders
        beside it.

    Raises
    ------
    FileNotFoundError
        When there is no result file.
    """
    campaign = read_campaign(Path(results))
    if output is None:
        writer = Writer(campaign.folder / "report", within=campaign.folder, text=True)
    else:
        writer = Writer(Path(output), text=True)
    with style.applied():
        sections = fitted(sections_of(campaign, writer))
    for section in sections:
        for table in section.tables:
            writer.table(table)
    page = writer.text("index.html", _render(campaign, sections))
    writer.finish()
    return page


def template(name: str) -> jinja2.Template:
    """A page's template, which escapes all that it shows.

    Its filters: ``unbroken`` keeps ``2.8e-10`` on one line, ``anchor`` gives the identifier of a
    run, ``base64`` the bytes of an image, ``sha256`` the sum by which a policy knows a script, and
    ``json`` what a script reads.
    """
    loader = jinja2.PackageLoader("mpmbench", package_path="")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"unbroken": _unbroken, "anchor": anchor}
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode()
    environment.filters |= {"sha256": _sha256, "json": json.dumps}
    return environment.get_template(name)


def _sha256(script: str) -> str:
    """What a policy calls the only script that may run."""
    return f"sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}"


def _unbroken(text: str) -> markupsafe.Markup:
    parts = re.split(r"(-?\d+(?:\.\d+)?e-\d+)", text)
    kept = [markupsafe.Markup('<span class="whole">{}</span>').format(part) for part in parts[1::2]]
    parts[1::2] = kept
    return markupsafe.Markup("").join(parts)


def _code_versions(campaign: Campaign) -> int:
    """Most versions of the code behind runs of one kind: a kind's code are the files it uses."""
    if "code_hash" not in campaign.provenance:
        return 1
    keys = ("problem", "method", "basis", "material")
    kinds = [campaign.runs[key] for key in keys if key in campaign.runs]
    return int(campaign.provenance["code_hash"].groupby(kinds).nunique().max())


def facts(campaigns: Collection[Campaign]) -> dict[str, Any]:
    """What every page says of its runs: how they ended, and what made them."""
    status = [word for campaign in campaigns for word in campaign.runs.get("status", ())]
    origin: dict[str, set[str]] = {}
    for campaign in campaigns:
        for key, values in campaign.provenance.items():
            origin.setdefault(str(key), set()).update(map(str, values.dropna()))
    origin.pop("code_hash", None)
    return {
        "counts": dict(sorted(Counter(status).items())),
        "total": len(status),
        "unverified": unverified(file for one in campaigns for file in one.unverified),
        "unreadable": {file: why for one in campaigns for file, why in one.unreadable.items()},
        "provenance": {key: sorted(values) for key, values in sorted(origin.items())},
        "interval_meaning": INTERVAL_MEANING,
    }


def _render(campaign: Campaign, sections: list[Section]) -> str:
    script = files("mpmbench.report").joinpath("curves.js").read_text(encoding="utf-8")
    return template("report/page.html.jinja").render(
        script=markupsafe.Markup(script),
        title=campaign.folder.resolve().name,
        sections=sections,
        times=times([section.study for section in sections]),
        code_versions=_code_versions(campaign),
        **facts([campaign]),
    )
