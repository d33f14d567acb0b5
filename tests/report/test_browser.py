"""A campaign's page in a real browser: by the rules of axe-core, on a desktop and a phone, light and dark.

Needs chromium, and the extra `browser` of the package.
"""

import base64
import hashlib
import html
import importlib.util
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mpmbench.report import build
from mpmbench.report.page import template

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
AXE = importlib.util.find_spec("axe_core_python")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not CHROMIUM, reason="needs the browser chromium"),
    pytest.mark.skipif(AXE is None, reason="needs axe-core: pip install 'mpmbench[browser]'"),
]
SCREENS = {"desktop": 1300, "phone": 390}
# What is asked for beyond the rules of axe: targets of 24 px, no page wider than the screen, and curves
# that answer to a pointer, a button and the arrow keys.
ASK = """
addEventListener("load", async () => {
  const found = {}, figure = document.querySelector("figure[data-axes]");
  if (figure) {
    const button = figure.querySelector("button"), said = figure.querySelector("output");
    const group = figure.querySelector('g[id$="curve-0-0"]'), drawing = figure.querySelector("svg");
    figure.querySelector("details").open = true;
    button.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowRight", bubbles: true}));
    found.byKey = said.textContent;
    found.mark = drawing.querySelectorAll(".mark").length;
    const point = group.querySelector("use").getBoundingClientRect();
    const at = {clientX: point.x + point.width / 2, clientY: point.y + point.height / 2, bubbles: true};
    said.textContent = "";
    drawing.dispatchEvent(new PointerEvent("pointermove", at));
    found.byPointer = said.textContent;
    button.click();
    found.off = [button.getAttribute("aria-pressed"), group.style.display];
    button.click();
    found.on = [button.getAttribute("aria-pressed"), group.style.display];
  }
  const small = [...document.querySelectorAll("a, button, summary")].filter(one => {
    const box = one.getBoundingClientRect();
    return box.width && (box.width < 24 || box.height < 24);
  });
  found.small = small.map(one => one.outerHTML.slice(0, 100));
  found.wide = document.documentElement.scrollWidth - innerWidth;
  found.dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const checked = await axe.run(document);
  found.passes = checked.passes.length;
  found.violations = checked.violations.map(
    one => `${one.impact} ${one.id}: ${one.nodes.slice(0, 3).map(node => node.html.slice(0, 120)).join(" | ")}`);
  parent.postMessage(JSON.stringify(found), "*");
});
"""
FRAME = """<!doctype html><title>frame</title><iframe src="asked.html" width="{width}" height="900"></iframe>
<script>addEventListener("message", event => {{
  const pre = document.createElement("pre"); pre.id = "found"; pre.textContent = event.data;
  document.body.append(pre); }});</script>"""


def asked(page: Path, width: int, dark: bool = False) -> dict[str, object]:
    """What a browser window of that width [px] finds on a page, under the page's own policy."""
    axe = Path(str(AXE.submodule_search_locations[0])) / "axe.min.js"
    scripts = [axe.read_text("utf-8"), ASK]
    sums = [
        f"'sha256-{base64.b64encode(hashlib.sha256(one.encode()).digest()).decode()}'"
        for one in scripts
    ]
    text = page.read_text("utf-8")
    policy = re.search(r"script-src [^;]*", text)
    text = (
        text.replace(policy[0], f"{policy[0]} {' '.join(sums)}")
        if policy
        else text.replace(
            "default-src 'none';", f"default-src 'none'; script-src {' '.join(sums)};"
        )
    )
    inserted = "".join(f"<script>{one}</script>" for one in scripts)
    page.with_name("asked.html").write_text(text.replace("</body>", f"{inserted}</body>"), "utf-8")
    frame = page.with_name("frame.html")
    frame.write_text(FRAME.format(width=width), "utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    command += ["--window-size=1500,1000", "--virtual-time-budget=120000"]
    command += [f"--user-data-dir={page.parent / 'profile'}"]
    command += ["--blink-settings=preferredColorScheme=0"] if dark else []
    done = subprocess.run([*command, frame.as_uri()], capture_output=True, timeout=300)
    said = re.search(r'<pre id="found">(.*?)</pre>', done.stdout.decode(), re.DOTALL)
    assert said, done.stderr.decode()[-2000:]
    return json.loads(html.unescape(said[1]))


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A campaign of two problems, in one and in two dimensions, with runs that failed."""
    from .conftest import make_quickstart, make_run

    folder = tmp_path_factory.mktemp("browser") / "quickstart"
    make_quickstart(folder)
    for resolution in (4, 8):
        scalars = {"final_run_out": 0.5 + 1.0 / resolution}
        make_run(folder, resolution=resolution, dimension=2, problem="soil_column", scalars=scalars)
    return build(folder)


@pytest.mark.parametrize(("screen", "dark"), [("desktop", False), ("phone", True)])
def test_nothing_keeps_a_reader_out(page, screen, dark):
    found = asked(page, SCREENS[screen], dark)
    assert found["violations"] == [] and found["passes"] > 20
    assert found["small"] == [], "targets are at least 24 pixels wide and high"
    assert found["wide"] <= 0, "the page is no wider than the screen"
    assert found["dark"] == dark


def test_curves_are_switched_and_read_off_by_pointer_and_keyboard(page):
    found = asked(page, SCREENS["desktop"])
    # the first run of the first curve: 7e-4 / 8**2 m and the floor
    words = "MPM, linear (lumped mass): 2.00 (2.00 to 2.00): RMS displacement error [m] 0.0000109"
    for said in (found["byKey"], found["byPointer"]):
        assert said == f"{words} at cells along the reference length 8"
    assert found["mark"] == 1
    assert found["off"] == ["false", "none"] and found["on"] == ["true", ""]


def test_the_browser_would_notice(tmp_path):
    policy = template("report/parts.html.jinja").module.policy()
    bad = tmp_path / "bad.html"
    bad.write_text(
        f"<!doctype html><html><head>{policy}<title>x</title></head><body><h1>x</h1><h4>y</h4>"
        "<p style='color:#aaa;background:#fff'>pale</p><a href='#x' style='width:5px'>.</a>"
        "<table><tr><td style='min-width:3000px'>wide</td></tr></table></body></html>"
    )
    found = asked(bad, SCREENS["phone"])
    told = " ".join(found["violations"])
    assert "color-contrast" in told and "html-has-lang" in told and "heading-order" in told
    assert found["small"] and found["wide"] > 0
