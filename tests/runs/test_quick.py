"""Values that we put into a composition ourselves end up as Hydra would have put them."""

import pytest
from hydra import compose, initialize_config_dir

from mpmbench.runs.hydra.compose import as_sweep, compose_many, resolved, with_hydra
from mpmbench.runs.hydra.composer import Composer
from mpmbench.settings.files import shipped_folder
from mpmbench.settings.schema import BadInput

ALIKE = [
    "",
    "resolution=8",
    "resolution=8 resolution=9",
    "method=otm basis=bspline basis.degree=3",
    "method=unified method.mass=lumped time_step=auto",
    "problem=plate_axis_aligned problem.body_force=false end_time=1e-3",
    "material=neo_hookean material.young_modulus=5",
    "snapshot_times=[0.1,2e-1] seed=3 limits.time=5 limits.memory=null",
    "campaign='a name' output_dir=some/where",
    "experiments=quickstart campaign=mine",
    "method=otm method.transfer=flip basis.d_max=2.5 basis.prior=gaussian",
    "experiments=quickstart time_step=2e-5",
]


def both(line):
    """One composition by us, and by Hydra."""
    pairs = line.split() if "'" not in line else ["campaign='a-name'", "output_dir=some/where"]

    def action():
        with initialize_config_dir(str(shipped_folder("conf")), version_base="1.3"):
            hydra = lambda pairs: compose("config", pairs, return_hydra_config=True)  # noqa: E731
            return Composer(hydra).cell(pairs), resolved(hydra(pairs))

    return with_hydra(action, pairs)


@pytest.mark.parametrize("line", ALIKE)
def test_the_same_as_hydra(line):
    ours, theirs = both(line)
    assert ours == theirs


@pytest.mark.parametrize(
    "line", ["basis.degree=2", "limits={time:5}", "output_dir=${campaign}", "resolution=1,2"]
)
def test_what_is_not_simple_is_left_to_hydra(line):
    def action():
        with initialize_config_dir(str(shipped_folder("conf")), version_base="1.3"):
            return Composer(lambda pairs: compose("config", pairs, return_hydra_config=True)).cell(
                [line]
            )

    assert with_hydra(action, [line]) is None


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


def test_keys_below_groups_are_choices_of_one_in_a_sweep():
    assert as_sweep(["basis.degree=2", "resolution=8", "basis.d_max=2,3"]) == [
        "basis.degree=choice(2)", "resolution=8", "basis.d_max=2,3",
    ]  # fmt: skip
    with pytest.raises(BadInput, match="belongs to bspline"):
        compose_many([["basis.degree=2"]])
