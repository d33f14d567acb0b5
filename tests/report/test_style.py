"""One colour per method and one marker per basis, everywhere and for everyone."""

import itertools

import matplotlib
import numpy as np
import pytest

from mpmbench.report import style

# Machado, Oliveira and Fernandes (2009), full deficiency, on linear RGB.
DEFICIENCIES = {
    "none": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}


def seen(colour, deficiency):
    """The colour in sRGB, 0 to 1, as it is seen."""
    rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    linear = np.clip(DEFICIENCIES[deficiency] @ rgb**2.2, 0.0, 1.0)
    return linear ** (1 / 2.2)


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_methods_of_the_house_differ_for_every_reader(deficiency):
    colours = [*style.METHOD_COLOURS.values(), "#000000"]
    for one, other in itertools.combinations(colours, 2):
        assert np.linalg.norm(seen(one, deficiency) - seen(other, deficiency)) > 0.12, (one, other)


def test_markers_and_colours_are_one_to_one():
    assert len(set(style.METHOD_COLOURS.values())) == len(style.METHOD_COLOURS)
    assert len(set(style.BASIS_MARKERS.values())) == len(style.BASIS_MARKERS)
    assert not set(style.PLUGIN_COLOURS) & set(style.METHOD_COLOURS.values())
    assert not set(style.PLUGIN_MARKERS) & set(style.BASIS_MARKERS.values())


def test_plugins_keep_their_look_from_run_to_run():
    assert style.colour("my_method") == "#44AA99"
    assert style.marker("rbf_cubic") in style.PLUGIN_MARKERS
    assert style.marker("rbf_cubic") == style.marker("rbf_cubic")


def test_variants_of_one_pair_share_colour_and_marker_but_not_the_line():
    looks = [style.line("otm", "maxent", rank) for rank in range(8)]
    assert {look["color"] for look in looks} == {style.METHOD_COLOURS["otm"]}
    assert {look["marker"] for look in looks} == {"^"}
    assert len({(look["linestyle"], look["markerfacecolor"]) for look in looks}) == 8


def test_figures_begin_with_the_defaults_of_matplotlib():
    found = {"axes.facecolor": "red", "text.usetex": True, "lines.linestyle": ":", "font.size": 30}
    with matplotlib.rc_context(found):
        with style.applied():
            inside = {key: matplotlib.rcParams[key] for key in found}
        assert matplotlib.rcParams["axes.facecolor"] == "red"
    assert list(inside.values()) == ["white", False, "-", style.SETTINGS["font.size"]]
