"""In what a comparison differs: found from configurations, said in a sentence with what mends it."""

from mpmbench.results.differences import differences, sentences, settings_of
from mpmbench.runs.hydra.compose import compose_sweep
from mpmbench.runs.sweep import display
from mpmbench.runs.sweep.plan import Cell, Plan

MASS = (
    "mass: lumped for mpm, consistent for otm and unified (method.mass=consistent makes them equal)"
)


def said(*words):
    """What a terminal says before the first run of a sweep."""
    return display.comparison(Plan([Cell(config) for config, _ in compose_sweep(words)]))


def test_a_sweep_says_in_what_its_methods_differ_before_the_first_run():
    words = ("method=mpm,otm,unified", "basis=linear,bspline,maxent", "resolution=8,16,32")
    head, *lines = said(*words).replace("\n    ", " ").splitlines()  # as it was before wrapping
    assert head == "Curves will differ in more than what is swept:"
    assert lines[0].strip() == MASS
    assert [line.split(":")[0].strip() for line in lines] == ["mass", "nodes", "transfer"]


def test_what_is_made_equal_or_swept_is_no_difference():
    equal = said("method=mpm,otm", "method.mass=consistent", "resolution=8")
    assert "mass" not in equal and "nodes: fixed for mpm, moving for otm" in equal
    assert said("method=mpm", "basis=linear,maxent", "method.mass=lumped,consistent") == ""
    assert "degree" not in said("method=mpm,otm", "basis=linear,bspline", "resolution=8")


def test_a_choice_that_goes_with_a_basis_names_it():
    runs = [
        ("mpm", "lme", {"basis.gamma": 1.8}),
        ("mpm", "mls", {"basis.gamma": 4.0}),
        ("otm", "lme", {"basis.gamma": 1.8}),
    ]
    (sentence,) = sentences(differences(runs), {"mpm": "MPM", "lme": "LME"})
    assert (
        sentence
        == "gamma: 1.8 for MPM LME and otm, 4.0 for MPM mls (basis.gamma=1.8 makes them equal)"
    )


def test_materials_and_sizes_count_and_bookkeeping_does_not():
    def run(method, material, **more):
        parts = {"problem": {"name": "bar"}, "basis": {"name": "linear"}}
        return settings_of(
            parts | {"method": {"name": method}, "material": {"name": material}} | more
        )

    runs = [run("mpm", "neo_hookean", resolution=8, rerun="all", limits={"time": 1.0}),
            run("otm", "hencky_elastic", resolution=16, rerun="missing", limits={"time": 9.0})]  # fmt: skip
    assert [one.key for one in differences(runs)] == ["material", "resolution"]
