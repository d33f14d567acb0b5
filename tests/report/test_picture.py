"""Pictures and films of results: which field, which colours, what stands where."""

import io
import stat

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from mpmbench.cli import main
from mpmbench.report import picture
from mpmbench.report.fields import NoField, field_of, names_of
from mpmbench.report.notebook import Result
from mpmbench.results import netcdf


def result(dim: int, particles: int = 27, instants: int = 3, exact: bool = True) -> xr.Dataset:
    """Particles that move to the right, with a stress and a velocity that are known."""
    rng = np.random.default_rng(dim)
    X = rng.uniform(0.0, 2.0, (particles, dim))
    times = np.linspace(0.0, 0.4, instants)
    u = np.zeros((instants, particles, dim))
    u[:, :, 0] = times[:, None]
    axes, tensor = ("snapshot", "particle", "dim"), ("snapshot", "particle", "dim", "dim2")
    stress = np.zeros((instants, particles, dim, dim))
    stress[..., 0, dim - 1] = X[:, 0] * times[:, None]
    data = {
        "position_initial": (("particle", "dim"), X),
        "position": (axes, X + u),
        "displacement": (axes, u, {"units": "m", "long_name": "displacement"}),
        "stress": (tensor, stress, {"units": "Pa"}),
        "volume": (axes[:2], np.full((instants, particles), 0.1**dim), {"units": f"m{dim}"}),
    }
    if exact:
        data["displacement_exact"] = (axes, 2.0 * u)
    coords = {"snapshot_time": ("snapshot", times)}
    return xr.Dataset(data, coords, {"problem": "some$problem", "method": "mpm", "basis": "linear"})


def test_fields_have_names_components_and_errors():
    flat = result(2)
    assert {"stress", "stress_12", "stress_22", "displacement_1", "displacement_error"} <= {
        *names_of(flat)
    }
    assert "stress_error" not in names_of(flat)
    shear = field_of(flat, "stress_12")
    assert np.array_equal(shear.values, flat.stress.values[:, :, 0, 1]) and shear.exact is None
    assert shear.values.max() > 0.0 and not field_of(flat, "stress_21").values.any()
    assert "component 12 [Pa]" in shear.label
    u = field_of(flat, "displacement")
    assert np.allclose(u.values, np.linalg.norm(flat.displacement, axis=2))
    assert np.allclose(u.exact, 2.0 * u.values)
    assert np.allclose(field_of(flat, "displacement_error").values, u.values)  # | u - 2 u |
    line = result(1)
    line["displacement"] = -line.displacement
    assert field_of(line, "displacement").values.min() == -0.4  # its sign in 1D
    assert np.allclose(field_of(line, "displacement_error").values[-1], 1.2)
    with pytest.raises(NoField, match=r"no field pressure; there are .*stress_12"):
        field_of(flat, "pressure")
    with pytest.raises(NoField, match="did not come to its end"):
        field_of(xr.Dataset())


def test_what_is_known_of_particles_once_is_a_field_too():
    still = result(1)
    X = still.position_initial
    still["shape_function"] = (("particle", "shown"), np.hstack([X, 1.0 - X]), {"units": "1"})
    assert {"shape_function", "shape_function_1", "shape_function_2"} <= {*names_of(still)}
    assert "position_initial" not in names_of(still)
    second = field_of(still, "shape_function_2")
    assert second.values.shape == still.displacement.shape[:2]
    assert np.array_equal(second.values, np.broadcast_to(1.0 - X[:, 0], second.values.shape))
    for name in ("displacement", "stress"):  # nothing moves: what remains is drawn
        still[name] = 0.0 * still[name]
    del still["displacement_exact"]
    assert field_of(still).name == "shape_function"


def test_the_most_telling_field_varies():
    flat = result(2, exact=False)
    assert field_of(flat).name == "stress"
    each = flat.volume.dims
    assert field_of(flat.assign(plastic_strain=(each, np.zeros((3, 27))))).name == "stress"
    flowing = flat.assign(plastic_strain=(each, np.linspace(0, 1, 81).reshape(3, 27)))
    assert field_of(flowing).name == "plastic_strain"
    assert field_of(result(2)).name == "displacement"  # whose exact solution is known


def test_colours_leave_out_single_values_and_what_is_no_number():
    flat = result(2, particles=1000, exact=False)
    values = np.tile(np.linspace(10.0, 20.0, 1000), (3, 1))
    values[0, :3], values[1, 0], values[2, 0] = 1e9, np.nan, -np.inf
    field = field_of(flat.assign(heat=(flat.volume.dims, values)), "heat")
    low, high = field.limits()
    assert 10.0 < low < 10.3 and 19.7 < high < 20.1
    assert field.beyond((low, high)) == "both" and field.beyond((-np.inf, 1e10)) == "neither"
    constant = field_of(flat.assign(heat=(flat.volume.dims, np.full((3, 1000), -4.0))), "heat")
    assert constant.limits() == (-6.0, -2.0)
    assert field_of(flat, "stress_22").limits() == (0.0, 1.0)


@pytest.mark.parametrize("dim", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_pictures_and_films_in_every_dimension(dim):
    data = result(dim)
    figure = picture.picture(data, "displacement")
    assert r"t = 0.4 s" in figure.get_suptitle() and r"some\$problem" in figure.get_suptitle()
    image = Image.open(io.BytesIO(picture.rendered(figure)))
    assert min(image.size) > 100 and len(image.convert("RGB").getcolors(10**6)) > 5
    pictures = picture.film(data, "displacement")
    assert len(pictures) == 3 and len({one.size for one in pictures}) == 1
    assert pictures[0].tobytes() != pictures[-1].tobytes()
    film = Image.open(io.BytesIO(picture.gif(pictures, 2.0)))
    assert (film.format, film.n_frames, film.info["duration"]) == ("GIF", 3, 1000)
    for k in range(film.n_frames):
        film.seek(k)
        assert film.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def test_a_window_holds_all_particles_that_are_somewhere():
    places = np.array([[[0.0, 0.0], [2.0, 1.0]], [[3.0, -1.0], [np.nan, 5.0]]])
    window = picture.frame([places], np.full((2, 2), 0.5))
    assert window.tolist() == [[-0.5, -1.5], [3.5, 1.5]]


def test_the_exact_solution_stands_beside_at_its_own_place():
    data = result(2)
    computed, exact = picture.picture(data, "displacement").axes[:2]
    assert (computed.get_title(), exact.get_title()) == ("computed", "exact")
    at = [np.asarray(one.collections[0].get_offsets()) for one in (computed, exact)]
    assert np.allclose(at[0], data.position[-1]) and np.allclose(at[1] - at[0], [0.4, 0.0])
    shown = [one.collections[0].get_array() for one in (computed, exact)]
    assert np.allclose(shown[0], 0.4) and np.allclose(shown[1], 0.8)
    alone = picture.picture(data, "displacement", view=picture.View(exact=False))
    assert [one.get_title() for one in alone.axes][:1] == [""] and len(alone.axes) == 2
    line = picture.picture(result(1), "displacement").axes[0]
    (curve, dots) = line.get_lines()
    assert np.allclose(curve.get_ydata(), 0.8) and np.allclose(dots.get_ydata(), 0.4)


def test_the_commands_write_files(write_run, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    results = tmp_path / "results"
    plate = write_run(results, dimension=2, problem="plate")
    bar = write_run(results)
    assert main(["show", str(results)]) == 0
    found = sorted(file.name for file in (results / "pictures").iterdir())
    assert found == sorted([f"{plate.stem}-stress.png", f"{bar.stem}-stress.png"])
    assert main(["show", str(results), "--sheet", "--out=all"]) == 0
    whole = np.array(Image.open("all/sheet.png"))
    assert whole.shape[1] == 2 * picture.TILE, "two results side by side"
    assert all(half.min() < 128 for half in np.split(whole, 2, axis=1)), "both are drawn"
    assert main(["show", str(bar), "velocity", "--out=here.png", "--time=0"]) == 0
    assert Image.open("here.png").format == "PNG"
    assert main(["show", str(bar), "--field=velocity", "--out=there.png", "--time=0"]) == 0
    assert np.array_equal(np.array(Image.open("here.png")), np.array(Image.open("there.png")))
    assert main(["animate", str(bar), "--out=film.gif", "--limits=0,1"]) == 0
    assert "snapshots=40" in capsys.readouterr().out
    failed = write_run(results, status="diverged", reason="so it is", resolution=16)
    assert main(["show", str(results), "stress"]) == 1  # the others are drawn
    out = capsys.readouterr().out
    assert f"left out: {failed.name}: " in out and out.count(".png") == 2
    for words, sentence in (
        ([str(failed)], "did not come to its end"),
        ([str(bar), "presure"], "there is no field presure"),
        ([str(bar), "velocity", "--field=stress"], "name one field"),
        ([str(bar), "--time=7"], "--time=7: the result is from 0 to"),
        ([str(bar), "--limits=2,1"], "must be the larger one"),
        ([str(bar), "--view=a"], "two numbers are needed"),
        ([str(bar), "--out=here.jpg"], "ending in .png"),
    ):
        assert main(["show", *words]) == 2
        err = capsys.readouterr().err
        assert sentence in err and err.count("\n") == 1


def test_an_mp4_is_what_ffmpeg_makes_of_all_pictures(write_run, tmp_path, monkeypatch, capsys):
    """By a stand-in that keeps what it is given; without ffmpeg it is said that it is missing."""
    bar = write_run(tmp_path / "results")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["animate", str(bar), "--mp4"]) == 2
    assert "ffmpeg is not here" in capsys.readouterr().err
    tool = tmp_path / "ffmpeg"
    tool.write_text('#!/bin/sh\nfor last; do :; done\necho "$*" > "$0.words"\n/bin/cat > "$last"\n')
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
    assert main(["animate", str(bar), "--mp4", f"--out={tmp_path}/film.mp4"]) == 0
    words = (tmp_path / "ffmpeg.words").read_text().split()
    width, height = map(int, words[words.index("-s") + 1].split("x"))
    instants = netcdf.load(bar).sizes["snapshot"]
    assert (tmp_path / "film.mp4").stat().st_size == instants * width * height * 3
    tool.write_text("#!/bin/sh\necho no such encoder >&2\nexit 3\n")
    assert main(["animate", str(bar), "--mp4", f"--out={tmp_path}/film.mp4"]) == 1
    assert "no such encoder" in capsys.readouterr().err


def test_a_result_shows_itself_in_a_notebook(write_run, tmp_path):
    bar = Result.of(netcdf.load(write_run(tmp_path)))
    page = bar._repr_html_()
    assert 'src="data:image/png;base64,' in page and 'alt="Particles of bar_fixed_ends' in page
    assert '<td style="text-align:left">ok</td>' in page and "error_displacement_rms" in page
    assert "xr-wrap" in page  # and what xarray says of it
    assert isinstance(bar.isel(snapshot=[-1]), Result)
    assert bar.show("velocity", exact=False).get_suptitle() == bar.show().get_suptitle()
    with Image.open(io.BytesIO(bar.show("velocity")._repr_png_())) as shown:  # without pyplot too
        assert shown.format == "PNG" and shown.width > 300
    failed = Result.of(netcdf.load(write_run(tmp_path, status="diverged", reason="a < b")))
    page = failed._repr_html_()
    assert "<img" not in page and "diverged: a &lt; b" in page
    assert "<table>" not in Result({"x": 1.0})._repr_html_()
