"""A paper from outside the package: one folder with its page, its claims and its experiments."""

import shutil
from pathlib import Path

import pytest
import yaml

import mpmbench
from mpmbench import papers
from mpmbench.commands import reproduce
from mpmbench.papers import HOLDS, read_campaigns
from mpmbench.report.claims import judge
from mpmbench.runs.hydra import compose
from mpmbench.settings.schema import BadInput, experiments

SAMPLE = Path(mpmbench.__file__).parent / "samples"


@pytest.fixture
def sample(monkeypatch) -> None:
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(SAMPLE))


def brought(folder: Path, monkeypatch, text: str | None = None) -> Path:
    """A copy of the sample in a folder of plug-ins; its file, with another text if one is given."""
    shutil.copytree(SAMPLE / "papers", folder / "papers")
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    file = folder / "papers" / "bar_orders" / "paper.py"
    if text is not None:
        file.write_text(text)
    return file


def test_is_found_beside_ours(sample) -> None:
    assert papers.names() == [
        *("bar_orders", "family", "family_studies", "iaconeta2017", "li2009", "wobbes2020")
    ]
    assert papers.find("bar_orders").claims[0].name == "order"
    with pytest.raises(KeyError):
        papers.find("nobody2020")


def test_is_gone_without_its_folder() -> None:
    assert "bar_orders" not in papers.names() and "bar_orders/bar" not in experiments()


@pytest.mark.parametrize("place", ["papers/bar_orders/experiments", "experiments/bar_orders"])
def test_experiments_are_in_its_folder_or_beside(tmp_path, monkeypatch, place) -> None:
    file = brought(tmp_path, monkeypatch).parent / "experiments" / "bar.yaml"
    target = tmp_path / place / "bar.yaml"
    target.parent.mkdir(parents=True, exist_ok=True)
    file.rename(target)
    assert experiments()["bar_orders/bar"] == target
    configs = [config for config, _ in compose.compose_sweep(["experiments=bar_orders/bar"])]
    assert len(configs) == 12 and {config["campaign"] for config in configs} == {"bar_orders/bar"}
    assert [one.short for one in reproduce.choose("bar_orders", tmp_path)] == ["bar"]


def test_its_experiments_bring_its_plugins(tmp_path, monkeypatch) -> None:
    folder = brought(tmp_path, monkeypatch).parent
    option = folder / "plugins" / "conf" / "method" / "mpm_of_the_paper.yaml"
    option.parent.mkdir(parents=True)
    option.write_text("name: mpm\n")
    (one,) = reproduce.choose("bar_orders", tmp_path)
    assert one.plugins is None
    one.file.write_text(one.file.read_text().replace("method=mpm ", "method=mpm_of_the_paper "))
    assert one.plugins == folder / "plugins"


def test_becomes_a_page_from_its_own_files(tmp_path, monkeypatch, sample, write_run, only_svg):
    for n in (4, 8, 16, 32):
        write_run(tmp_path / "results/bar_orders/bar", resolution=n, floor=0.0, snapshot=False)
    monkeypatch.chdir(tmp_path)
    chosen = reproduce.choose("bar_orders", Path("results"))
    assert reproduce.report("bar_orders", Path("results/bar_orders"), chosen)
    text = Path("reports/bar_orders/README.md").read_text()
    assert f"| MPM converges with order 2 (Fig. 1) | {HOLDS} | p = 2.00 |" in text
    assert "## The bar with fixed ends" in text
    campaigns = read_campaigns(Path("results/bar_orders"))
    claim = papers.find("bar_orders").claims[0]
    assert judge(claim, campaigns).answer == HOLDS


def test_modules_beside_it_are_its_own(tmp_path, monkeypatch) -> None:
    text = "from .words import TITLE\nfrom mpmbench.papers import Paper\n"
    text += 'PAPER = Paper("bar_orders", TITLE, "", ())\n'
    file = brought(tmp_path, monkeypatch, text)
    file.with_name("words.py").write_text('TITLE = "from beside"\n')
    assert papers.find("bar_orders").title == "from beside"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("PAPER = 1 / 0\n", "paper.py: the paper cannot be imported: ZeroDivisionError"),
        (
            'from mpmbench.papers import Paper\nPAPER = Paper("other", "", "", ())\n',
            "the paper is called other, but its file or folder bar_orders",
        ),
    ],
)
def test_faults_are_said_with_the_file(tmp_path, monkeypatch, text, says) -> None:
    brought(tmp_path, monkeypatch, text)
    with pytest.raises(BadInput, match=says):
        papers.find("bar_orders")


def test_a_name_is_given_once(tmp_path, monkeypatch) -> None:
    file = brought(tmp_path, monkeypatch)
    file.parent.rename(tmp_path / "papers" / "li2009")
    with pytest.raises(BadInput, match="the paper li2009 is there twice"):
        papers.names()


def test_the_sample_is_short(sample) -> None:
    (file,) = (SAMPLE / "papers").rglob("*.py")
    assert len(file.read_text().splitlines()) <= 40
    assert yaml.safe_load(experiments()["bar_orders/bar"].read_text())["cases"]
