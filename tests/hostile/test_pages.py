"""A page whose runs say hostile things in every place, opened in a real browser: nothing is run.

Every place of a file that a page may show gets each of `PAYLOADS`: what runs says so in the title of
the page, and asks a server of this test for a picture.
"""

import html
import json
import re
import shutil
import subprocess
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace

import netCDF4
import pytest

from mpmbench import papers
from mpmbench.report import build, page, writer
from mpmbench.results import digest
from mpmbench.results.records import read_campaign
from tests.report.conftest import make_run
from tests.report.test_hostile_files import ELEMENTS, LINK, Page

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="needs the browser chromium"),
]
RUN = "document.title='ran';new/**/Image().src='http://127.0.0.1:{port}/ran'"
PAYLOADS = (
    '"><img src=q onerror="{run}">',
    "'><img src=q onerror={run}>",
    "<script>{run}</script>",
    "</title></style></script><script>{run}</script>",
    "--><script>{run}</script><!--",
    "]]></svg><script>{run}</script>",
    'x" autofocus tabindex=1 onfocus="{run}',
    '"/><svg onload="{run}"><!--',
    '"><iframe srcdoc="<script>parent.{run}</script>"></iframe>',
    '"><meta http-equiv=refresh content="0;url=http://127.0.0.1:{port}/ran">',
    '"><base href="http://127.0.0.1:{port}/"><link rel=stylesheet href="ran">',
    '"><a href="javascript:{run}" id=x><details open ontoggle="{run}">',
    "javascript:{run}//",
    '#" style="background:url(http://127.0.0.1:{port}/ran)',
    "url(http://127.0.0.1:{port}/ran)",
    "&lt;script&gt;{run}&lt;/script&gt;&#60;script&#62;{run}",
    "{{{{ 7 * 7 }}}}{{% raw %}}<script>{run}</script>",
    "<b>*_[x](javascript:{run})_*</b>`|`\\",
    "../../../outside",
    "/tmp/mpmbench-outside",
    "a%2e%2e%2fb#c?d=e&f",
    "$\\frac{{$ \\input{{/etc/passwd}} ^_%",
    "line\nbreak\r\n\x1b]0;ran\x07\u202e\u2028end",
    "=cmd|' /c calc'!a1",
    "x" * 300,
)
TEXTS = (  # attributes of a result that are text
    *("problem", "method", "basis", "material", "mass", "timing_context", "reason"),
    *("config_hash", "code_hash", "git_commit", "git_dirty", "python", "host", "cpu", "started"),
    *("mpmbench_version", "numpy_version", "title", "traceback", "timings"),
)
PLACES = len(TEXTS) + 9  # and keys, values, names of variables, units, long names, file, attribute


def poison(file: Path, payload: str, value: float, problem: str) -> Path:
    """Put a payload into every place of a result file, its name included; `value` tells runs apart."""
    with netCDF4.Dataset(file, "a") as stored:
        config = json.loads(stored.config)
        for group in ("problem", "method", "basis", "material"):
            config[group] |= {"name": payload, f"word {payload}": payload}
        config["problem"][payload] = value
        config |= {f"list {payload}": [payload]}
        stored.setncatts(dict.fromkeys(TEXTS, payload) | {"config": json.dumps(config)})
        stored.problem = problem
        safe = payload.replace("/", "|").replace("\n", " ").replace("\r", " ")[:100]
        for name in (f"{safe} version", safe):
            try:  # netCDF refuses some names itself
                stored.setncattr(name, payload)
                stored.createVariable(f"error_{safe}_rms", "f8", ()).assignValue(value)
            except (RuntimeError, AttributeError, UnicodeError):
                continue
        for variable in stored.variables.values():
            variable.setncatts({"units": payload, "long_name": payload})
    digest.seal(file)  # who makes a file makes its digest
    # The library reads no names with a backslash; those that begin with a dot are temporary files.
    stem = re.sub(r"[/\\]", "|", payload).encode()[:150].decode(errors="ignore")
    return file.rename(file.with_name(f"r{stem}{file.name}"))


def fill(folder: Path, payloads: list[str]) -> int:
    """Three runs for each payload, one of which crashed; returns the number of hostile values.

    Five payloads share a problem, and no key has three values: figures take the time.
    """
    for k, payload in enumerate(payloads):
        for value in (1.0, 2.0, 3.0):
            status = "crashed" if value == 3.0 else "ok"
            file = make_run(folder, status=status, snapshot=False)
            file = file.rename(folder / f"{k}-{value}.nc")
            poison(file, payload, min(value, 2.0), payloads[k - k % 5])
    return 3 * len(payloads) * PLACES


class Server(ThreadingHTTPServer):
    """Counts what it is asked for."""

    def __init__(self) -> None:
        self.requests: list[str] = []
        requests = self.requests

        class Answer(BaseHTTPRequestHandler):
            def do_GET(self):
                requests.append(self.path)
                self.send_error(404)

            def log_message(self, *_):
                pass

        super().__init__(("127.0.0.1", 0), Answer)


@pytest.fixture
def browser(tmp_path):
    """Opens a file: its title once it was open for some seconds, and how often the server was asked."""
    with Server() as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()

        def opened(file: Path) -> tuple[str, int]:
            before = len(server.requests)
            command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
            command += [f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=4000"]
            done = subprocess.run([*command, file.as_uri()], capture_output=True, timeout=120)
            dom = done.stdout.decode(errors="replace")
            titles = re.findall(r"<title>(.*?)</title>", dom, re.DOTALL)
            return titles[0] if titles else "", len(server.requests) - before

        port = server.server_address[1]
        run = RUN.format(port=port)
        payloads = [payload.format(run=run, port=port) for payload in PAYLOADS]
        yield SimpleNamespace(opened=opened, payloads=payloads, run=run)
        server.shutdown()


def foreign(text: str) -> int:
    """How much of a page is not of ours: elements, handlers of events, links that lead elsewhere."""
    found = Page(text)
    links = found.of("href", "xlink:href", "src")
    return (
        len(found.elements - ELEMENTS)
        + sum(name.startswith("on") for name, _ in found.attributes)
        + sum(not LINK.fullmatch(link) for link in links)
    )


def without_policy(file: Path) -> Path:
    """The same page without the second line of its defence."""
    text, count = re.subn(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", file.read_text())
    assert count == 1
    bare = file.with_name("bare.html")
    bare.write_text(text)
    return bare


def test_the_browser_would_notice(tmp_path, browser, counts):
    policy = page.template("report/parts.html.jinja").module.policy()
    raw, kept = tmp_path / "raw.html", tmp_path / "kept.html"
    for file, head in ((raw, ""), (kept, policy)):
        text = f"<title>safe</title><script>{browser.run}</script><img src=q onerror={browser.run}>"
        file.write_text(f"<!doctype html><meta charset=utf-8>{head}{text}")
    title, asked = browser.opened(raw)
    counts(
        "raw page: script noticed by its title and by the server", 2, (title == "ran") + (asked > 0)
    )
    title, asked = browser.opened(kept)
    counts("raw page under the policy: scripts that ran, requests", 0, (title != "safe") + asked)


@pytest.mark.parametrize("kind", ("campaign", "paper"))
def test_hostile_values_run_nothing(tmp_path, monkeypatch, browser, counts, kind):
    monkeypatch.setattr(writer, "FORMATS", {"svg": writer.FORMATS["svg"]})
    target = tmp_path / "here" / "report"
    if kind == "campaign":
        results = tmp_path / "here"
        values = fill(results, browser.payloads)
        written = build(results)
        files, title = read_campaign(results).runs.index, "here · mpmbench"
    else:
        results = tmp_path / "here" / "results"
        values = fill(results / "li2009" / 'x"><script>', browser.payloads)
        written = papers.build("li2009", results, target)
        files, title = list((results / "li2009").rglob("*.nc")), "li2009 · mpmbench"
    text = written.read_text(encoding="utf-8")
    counts(f"{kind}: runs on the page", 3 * len(PAYLOADS), len(files))
    counts(f"{kind}: hostile values in them", 3 * len(PAYLOADS) * PLACES, values)
    shown = html.unescape(text)
    missing = [one for one in browser.payloads if one.split("\n")[0][:40] not in shown]
    counts(f"{kind}: payloads that are not shown as text", 0, len(missing))
    counts(f"{kind}: elements, handlers and links that are not ours", 0, foreign(text))
    reports = (tmp_path / "here" / "report", results / "report")
    outside = [
        path
        for path in (*tmp_path.rglob("*"), *Path("/tmp").glob("mpmbench-outside*"))
        if path.is_file() and path.suffix != ".nc" and "profile" not in path.parts
        if not any(path.is_relative_to(place) for place in reports)
    ]
    counts(f"{kind}: files written outside of the report", 0, len(outside))
    for name, file in (("as it is", written), ("without its policy", without_policy(written))):
        found, asked = browser.opened(file)
        counts(f"{kind} {name}: scripts that ran", 0, int(found != title))
        counts(f"{kind} {name}: requests", 0, asked)
    if kind == "campaign":
        drawings = sorted((target / "figures").glob("*.svg"))[::4]
        seen = [browser.opened(file) for file in drawings]
        ran = sum(asked + (title == "ran") for title, asked in seen)
        counts(f"scripts that ran, or requests, in {len(seen)} figures alone", 0, ran)
