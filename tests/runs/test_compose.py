"""Compositions: values that we put in ourselves end up as Hydra would have put them, and the cells of a sweep."""

import pytest
from hydra import compose

from mpmbench.results.identity import result_path
from mpmbench.runs.hydra.compose import compose_many, compose_sweep, composing, expand
from mpmbench.runs.hydra.composer import resolved
from mpmbench.runs.sweep.display import shorten
from mpmbench.settings.arguments import split
from mpmbench.settings.schema import BadInput

ALIKE = [
    "",
    "resolution=8",
    "resolution=8 resolution=9",
    "method=otm basis=bspline basis.degree=3",
    "method=unified method.mass=lumped time_step=auto",
    "problem=plate_axis_aligned problem.body_force=false end_time=1e-3",
    "material=neo_hookean material.young_modulus=5",
    "snapshot_times=[1e-4,0.0002] seed=3 limits.time=5 limits.memory=null",
    "campaign='a name' output_dir=some/where",
    "experiments=quickstart campaign=mine",
    "method=otm method.transfer=flip basis.d_max=2.5 basis.prior=gaussian",
    "experiments=quickstart time_step=2e-5",
    "snapshots=3 end_time=0.3",
]


@pytest.mark.parametrize("line", ALIKE)
def test_the_same_as_hydra(line):
    pairs = line.split() if "'" not in line else ["campaign='a-name'", "output_dir=some/where"]
    with composing(pairs) as composer:
        assert composer.shared(pairs) == resolved(composer.compose(pairs))


EXCHANGED = [
    ("method=otm basis=lme", "method=mpm basis=bspline basis.degree=3", 1),
    ("method=otm", "method=unified", 2),  # each brings a basis
    ("method=otm basis=lme", "method=otm basis=maxent method.mass=lumped", 1),
    ("problem=six_cubes basis=lme", "problem=two_squares basis=lme", 2),
    ("problem=six_cubes contact=penalty", "problem=six_cubes contact=multi_field", 1),
    ("experiments=touching method=mpm basis=lme", "experiments=touching method=mpm basis=mls", 2),
    (
        "experiments=quickstart method=mpm basis=lme",
        "experiments=quickstart method=otm basis=mls",
        1,
    ),
]


@pytest.mark.parametrize(("first", "second", "calls"), EXCHANGED)
def test_exchanged_sections_are_those_of_hydra(first, second, calls, tmp_path, monkeypatch):
    """The second cell is what Hydra makes of it, by as many compositions; an experiment may fill a section too."""
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments/touching.yaml").write_text(
        "# @package _global_\nbasis:\n  relative_radius: 1.7\n"
    )
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(tmp_path))
    with composing(first.split()) as composer:
        whole, counted = composer.compose, []
        composer.compose = lambda words: counted.append(words) or whole(words)
        for line in (first, second):
            assert composer.shared(line.split()) == resolved(whole(line.split()))
        assert len(counted) == calls


@pytest.mark.parametrize(
    "line", ["basis.degree=2", "limits={time:5}", "output_dir=${campaign}", "resolution=1,2"]
)
def test_what_is_not_simple_is_left_to_hydra(line):
    with composing([line]) as composer:
        assert composer.shared([line]) is None


def test_hydra_composes_once_for_each_choice(monkeypatch):
    calls = []

    def counted(*arguments, **options):
        calls.append(arguments)
        return compose(*arguments, **options)

    monkeypatch.setattr("hydra.compose", counted)
    done = compose_many(
        [[f"method={method}", f"resolution={n}"] for n in range(1, 20) for method in ("mpm", "otm")]
    )
    assert [config["resolution"] for config, _ in done[::2]] == list(range(1, 20))
    assert len(calls) == 2


def test_a_key_of_another_option_is_wrong_in_a_run_and_does_not_apply_in_a_sweep():
    with pytest.raises(BadInput, match="the chosen basis has no degree, which belongs to bspline"):
        compose_many([["basis.degree=2"]])
    pairs = ["basis=linear,bspline", "basis.degree=2,3"]
    found = [(config["basis"].get("degree"), reason) for config, reason in compose_sweep(pairs)]
    assert found == [
        (2, "basis=linear has no degree"), (3, "basis=linear has no degree"), (2, ""), (3, ""),
    ]  # fmt: skip


def test_short_words_for_instants_give_the_same_run():
    lines = (
        "end_time=0.5 snapshots=4 snapshot_times=[0.1]",
        "end_time=0.5 snapshot_every=0.125 snapshot_times=[0.1]",
        "end_time=0.5 snapshot_times=[0.1,0.125,0.25,0.375]",
    )
    found = [config for config, _ in compose_many([line.split() for line in lines])]
    assert found[0] == found[1] == found[2]
    assert found[0]["snapshot_times"] == [0.1, 0.125, 0.25, 0.375]


CELLS = {
    "resolution=4,8 seed=1": ["resolution=4 seed=1", "resolution=8 seed=1"],
    "seed=choice(1,2)": ["seed=1", "seed=2"],
    "cfl=range(0.1,0.5,0.1)": ["cfl=0.1", "cfl=0.2", "cfl=0.3", "cfl=0.4"],
    "cfl=range(0,0.9,0.3)": ["cfl=0.0", "cfl=0.3", "cfl=0.6"],  # 0.9 is no value of it
    "cfl=0.30000000000000004,0.1": ["cfl=0.30000000000000004", "cfl=0.1"],  # as typed
    "resolution=range(1,4)": ["resolution=1", "resolution=2", "resolution=3"],
    "seed=1,2 seed=3": ["seed=3"],
    "snapshot_times=[0.1,0.2],[]": ["snapshot_times=[0.1,0.2]", "snapshot_times=[]"],
    "hydra/launcher=basic seed=1": ["seed=1"],
}


@pytest.mark.parametrize("line", CELLS)
def test_the_cells_of_a_command_line(line):
    with composing(line.split()) as composer:
        assert [" ".join(cell) for cell in expand(composer, line.split())] == CELLS[line]


def test_cases_beat_the_params_of_an_experiment_and_the_command_line_beats_both(
    folder, monkeypatch
):
    (folder / "conf").mkdir()
    (folder / "experiments").mkdir()
    (folder / "experiments/mine.yaml").write_text(
        "# @package _global_\ncases: [method=otm seed=7, basis=bspline]\n"
        "hydra: {mode: MULTIRUN, sweeper: {params: {seed: '1,2', method: mpm, resolution: 4}}}\n"
    )
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    line = ["experiments=mine", "resolution=8"]
    with composing(line) as composer:
        assert [" ".join(cell) for cell in expand(composer, line)] == [
            "resolution=8 experiments=mine method=otm seed=7",
            "seed=1 method=mpm resolution=8 experiments=mine basis=bspline",
            "seed=2 method=mpm resolution=8 experiments=mine basis=bspline",
        ]
        assert len(expand(composer, [*line, "seed=3", "method=mpm,unified"])) == 4


def test_a_sweep_over_an_interval_is_refused():
    with pytest.raises(BadInput, match="a list of values is needed, as in seed=1,2"):
        compose_sweep(["seed=interval(1,2)"])


@pytest.mark.parametrize(
    ("pair", "campaign"),
    [("true", "true"), ("007", "007"), ("1e3", "1e3"), ("2026_01", "2026_01"), ("'a-b'", "a-b")],
)
def test_names_of_folders_are_texts(folder, pair, campaign):
    _, pairs = split([f"campaign={pair}", f"output_dir={pair}"], [])
    for cells in (compose_many([pairs]), compose_sweep(pairs)):
        ((config, _),) = cells
        assert (config["campaign"], config["output_dir"]) == (campaign, campaign)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("resolution: 4\nresolution: 5\n", "line 2: not valid YAML: the key resolution is there twice"),
        ("campaign: true\n", "campaign = True: a name is needed, in quotes"),
        ("- resolution\n", "keys with values are needed"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_an_experiment_is_one_sentence(folder, monkeypatch, content, sentence):
    (folder / "experiments").mkdir()
    (folder / "experiments/mine.yaml").write_text(f"# @package _global_\n{content}")
    (folder / "experiments/marked.yaml").write_text("\ufeff# @package _global_\nseed: 3\n")
    monkeypatch.setenv("MPMBENCH_PLUGINS", str(folder))
    with pytest.raises(BadInput, match=sentence):
        compose_many([["experiments=mine"]])
    ((config, _),) = compose_many([["experiments=marked"]])  # with a byte order mark
    assert config["seed"] == 3


def test_the_name_of_a_file_fits_on_a_disk():
    ((config, _), (other, _)) = compose_many([[], ["seed=1"]])
    config["problem"]["name"] = other["problem"]["name"] = 300 * "ü"
    names = {result_path(one).name for one in (config, other)}
    assert len(names) == 2 and all(len(name.encode()) < 215 for name in names)


def test_a_folder_that_is_removed_while_something_runs_keeps_its_name(folder, monkeypatch):
    (folder / "gone").mkdir()
    monkeypatch.chdir(folder / "gone")
    ((config, _),) = compose_many([[]])
    before = result_path(config)
    (folder / "gone").rmdir()
    assert result_path(config) == before
    assert shorten(str(before)) == f"results/default/{before.name}"
    monkeypatch.chdir(folder)


STUDY = """# @package _global_
# Of my own.
defaults:
  - override /problem: bar_fixed_ends
end_time: 1.0e-4
hydra:
  mode: MULTIRUN
  sweeper:
    params:
      resolution: 2,4
"""


def test_an_experiment_is_run_from_its_file(command, folder):
    (folder / "mine").mkdir()
    file = folder / "mine" / "study.yaml"
    file.write_text(STUDY)
    assert command("experiments=mine/study.yaml", "report=false").code == 0
    found = sorted(one.parent for one in folder.rglob("*.nc"))
    assert found == [folder / "results" / "study"] * 2
    file.write_text(STUDY.replace("2,4", "2,4,8"))  # what is edited is read again
    outcome = command("status", "-m", f"experiments={file}")
    assert outcome.code == 0 and "1 missing" in outcome.out


def test_a_file_that_is_no_experiment_is_refused(command, folder):
    (folder / "quickstart.yaml").write_text(STUDY)
    (folder / "cal led.yaml").write_text(STUDY)
    (folder / "evil.yaml").write_text(STUDY.replace("  mode", "  callbacks: {a: {b: c}}\n  mode"))
    (folder / "calls.yaml").write_text(STUDY + "cases:\n  - _target_: os.system\n")
    for path, said in (
        ("./nowhere.yaml", "there is no such file"),
        ("./quickstart.yaml", "there is an experiment quickstart already"),
        ("./cal led.yaml", "a file named by letters"),
        ("./evil.yaml", "sets mode and sweeper.params only"),
        ("./calls.yaml", "_target_ is refused"),
    ):
        outcome = command(f"experiments={path}")
        assert (outcome.code, outcome.out) == (2, "") and said in outcome.err, outcome.err
