"""The documentation: its snippets do what they say, and it builds without a broken link."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [file for file in sorted(DOCS.rglob("*.md")) if "_build" not in file.parts]


def snippets(page: Path) -> list[tuple[str, str]]:
    """Language and text of the blocks of a page that can be run, and of a file that it shows."""
    text = page.read_text(encoding="utf-8")
    return re.findall(r"```(console|python|yaml)\n(.*?)```", text, re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [file for file in PAGES if snippets(file)], ids=lambda file: file.stem
)
def test_the_snippets_of_a_page_run_in_its_order(page, tmp_path):
    lines = ["set -eu", f'python() {{ "{sys.executable}" "$@"; }}']
    for language, text in snippets(page):
        if language == "console":
            lines.append(text)
        elif language == "python":
            lines.append(f"python - <<'END'\n{text}END")
        else:
            (tmp_path / "study.yaml").write_text(text)
    outcome = subprocess.run(
        ["bash", "-c", "\n".join(lines)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr


def test_pages_link_to_pages_that_are_there():
    generated = {"gallery.md", "reference/api.md", "reference/exit_codes.md"}
    found = 0
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if ":" not in target:
                file = (page.parent / target).resolve()
                found += 1
                known = file.exists() or str(file.relative_to(DOCS)) in generated
                known |= target.startswith("reports/") and (ROOT / target).exists()
                assert known, f"{page}: {target}"
    assert found > 10


def test_a_link_to_nowhere_is_found(tmp_path):
    spec = importlib.util.spec_from_file_location("build_docs", DOCS / "build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    (tmp_path / "a.html").write_text("<p id=here><a href='b.html#there'>b</a><a href='#here'>a</a>")
    (tmp_path / "b.html").write_text("<p id=there><img src='gone.png'><a href='a.html#gone'>a</a>")
    assert build.broken_links(tmp_path) == ["b.html: gone.png", "b.html: a.html#gone"]
    (tmp_path / "gone.png").write_text("")
    (tmp_path / "b.html").write_text("<p id=there><img src='gone.png'><a href='a.html#here'>a</a>")
    assert build.broken_links(tmp_path) == []


def test_the_reference_is_made_of_what_is_declared():
    spec = importlib.util.spec_from_file_location("build_docs", DOCS / "build.py")
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    keys, commands = "\n".join(build.keys()), "\n".join(build.commands())
    for said in ("`basis.d_max`", "### problem=soil_column", "`method.transfer_order`", "| `xpic`"):
        assert said in keys
    assert "## continue" in commands and "end_time=T" in commands
    assert "| 20 |" in "\n".join(build.exit_codes())


@pytest.mark.slow
def test_the_site_builds_from_the_sources():
    pytest.importorskip("sphinx", reason="the extra mpmbench[docs] is not installed")
    done = subprocess.run(
        [sys.executable, str(DOCS / "build.py")], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert ", 0 broken links" in done.stdout
