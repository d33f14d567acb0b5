"""The collapse of the soil column: Figs. 10-13, a check against Kratos, and an animation."""

import io
from collections.abc import Iterator
from contextlib import suppress
from itertools import product
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from PIL import Image

from mpmbench.papers.iaconeta2017.support import COLUMNS, MESHES, METHODS, history, look, particles
from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import of_file, quantities, thinned, with_digits
from mpmbench.report import style
from mpmbench.report.evidence import MissingRuns
from mpmbench.report.figures import panels, single
from mpmbench.report.tables import Cell
from mpmbench.report.timing import clock_in

SHOWN = (0.25, 0.5, 1.0, 2.0)  # [s]
STRAIN = (0.0, 1.5)  # colours of the equivalent plastic strain
COLOURS = 64  # of the moving picture
# time [s] and kinetic energy [J] of Kratos 10.4.4, h = 0.1 m, a(0) = g
REFERENCE = ((0.05, 717.1), (0.10, 239.2))
HISTORIES = ("time", "run_out", "kinetic_energy", "largest_plastic_strain", "snapshot_time")
COUNTS = ("stiffened_steps", "halved_steps")
COUNTED = ("stiffened steps", "halved steps", "solver time [s]")
SETUPS: dict[str, dict[str, object]] = {
    "a(0) = g": {"problem__initial_acceleration": "gravity"},
    "a(0) = 0": {
        "problem__initial_acceleration": "zero",
        "problem__initial_stress": "none",
        "mass": "consistent",
        "method__ghost_stiffness": 1e-6,
    },
    "K0 initial stress": {"problem__initial_stress": "k0"},
    "lumped mass": {"mass": "lumped"},
    "no ghost stiffness": {"method__ghost_stiffness": 0.0},
}


def soil_chapter(campaigns: Campaigns) -> Chapter:
    """Run-out and plastic strain of three methods on two or three meshes."""
    page = Chapter("soil", "Figs. 10-13: collapse of a cohesive soil column")
    page.statement = (
        "The paper: final configurations of MPM, GMM-LME and GMM-MLS are almost coincident, but "
        "not the equivalent plastic strains; in GMM the clouds must be repaired, MPM tracks large "
        "deformations without modification."
    )
    experiments = {run[1] for name in COLUMNS for run in _available(campaigns, name)}
    if not experiments:
        raise MissingRuns("there are no results of the experiment soil")
    _run_out(page, campaigns)
    _outlines(page, campaigns)
    for name in COLUMNS:
        _strains(page, campaigns, name)
    if "soil_base" in campaigns:
        _base(page, campaigns)
    page.notes.append(
        "Fig. 10 also has a curve of smoothed particle hydrodynamics, by Bui et al. 2008, whose "
        "run-out is larger; the paper prints no numbers of it. Ours cannot stand in: method=sph is "
        "refused here, since its particles are its nodes, and the base would need nodes that are no "
        "soil. It also lacks what Bui et al. add: artificial viscosity and, against the tensile "
        "instability of cohesive soil, artificial stress."
    )
    if "soil_fine" not in experiments:
        page.notes.append(
            "Not run here: the paper's second mesh, h = 0.025 m, which takes two hours and more. "
            "The command python -m mpmbench experiments=iaconeta2017_fine/soil runs it, and the "
            "next report on this paper shows it beside the others."
        )
    return page


def _available(
    campaigns: Campaigns, name: str
) -> Iterator[tuple[int, str, str, dict[str, np.ndarray]]]:
    """Resolution, experiment, file and history of the runs of a method."""
    for n, experiment in MESHES:
        with suppress(MissingRuns):
            match = {"resolution": n, **METHODS[name]}
            yield n, experiment, *history(campaigns, experiment, *HISTORIES, **match)


def _run_out(page: Chapter, campaigns: Campaigns) -> None:
    figure, axes = panels(1, 2, 2.9)
    widths = {40: 0.7, 80: 1.2, 160: 1.9}
    for name in COLUMNS:
        for n, _, _, found in _available(campaigns, name):
            line = look(name) | {"marker": None, "linewidth": widths[n]}
            line["label"] = f"{name}, h = {4.0 / n:g} m"
            time, run_out, energy = thinned(*(found[key] for key in HISTORIES[:3]))
            axes[0, 0].plot(time, run_out, **line)
            axes[0, 1].semilogy(time[1:], energy[1:], **line)
    axes[0, 0].set_ylabel("run-out [m]")
    axes[0, 1].set_ylabel("kinetic energy [J]")
    axes[0, 1].set_ylim(1.0, 2e3)
    for axis in axes[0]:
        axis.set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=6)
    caption = "Time step 2 ms; the finer the mesh, the thicker the line."
    page.draw("run-out", "Run-out and kinetic energy", caption, figure)
    rows = []
    clock = clock_in(campaigns, "soil", "soil_fine")
    for name, (n, experiment) in product(COLUMNS, MESHES):
        match = {**METHODS[name], "resolution": n}
        cells = _end(campaigns, experiment, clock.quantity, match)
        if cells[0].value != "":
            rows.append([name, f"{4.0 / n:g}", *cells])
    columns = ["method", "h [m]", "run-out at 2 s [m]", "largest plastic strain", *COUNTED]
    title = clock.title("At the end, t = 2 s")
    page.tabulate("ends", title, columns, rows, numeric=range(1, 7), note=clock.note)


def _end(campaigns: Campaigns, experiment: str, time: str, match: dict[str, Any]) -> list[Cell]:
    """Run-out, largest plastic strain, `COUNTS` and time of one run, or how it ended."""
    cells = quantities(campaigns, experiment, ("final_run_out", *COUNTS, time), **match)
    strain = cells[:1]
    with suppress(MissingRuns):
        file, found = history(campaigns, experiment, "largest_plastic_strain", **match)
        strain = of_file(file, found["largest_plastic_strain"][-1])
    return [cells[0], *strain, *cells[1:]]


def _base(page: Chapter, campaigns: Campaigns) -> None:
    """GMM with nodes that stick to the base, and with nodes that may sink through it."""
    rows = []
    stops = {"soil": "the base", "soil_base": "functions of the nodes there"}
    clock = clock_in(campaigns, *stops)
    wanted = ("final_run_out", *COUNTS, clock.quantity)
    for name, n, experiment in product(("GMM-MLS", "GMM-LME"), (40, 80), stops):
        match = {**METHODS[name], "resolution": n}
        counts = quantities(campaigns, experiment, wanted, **match)
        rows.append([name, f"{4.0 / n:g}", stops[experiment], *counts])
    columns = ["method", "h [m]", "nodes are stopped by", "run-out at 2 s [m]", *COUNTED]
    title = clock.title("What stops the nodes of GMM")
    page.tabulate("base", title, columns, rows, numeric=(1, 3, 4, 5, 6), note=clock.note)
    page.notes.append(
        "The paper relies on functions that soil and base share; nodes of the soil may sink "
        "between those of the base. In the figures nodes that reach the base stick to it "
        "(problem.base=plane)."
    )


def _strains(page: Chapter, campaigns: Campaigns, name: str) -> None:
    """Particles coloured by equivalent plastic strain at a few instants, one column per mesh."""
    meshes = list(_available(campaigns, name))
    if not meshes:
        return
    width = 2.0 * style.COLUMN / max(2, len(meshes))  # of a panel [in]
    rows, columns = len(SHOWN), len(meshes)
    figure, axes = panels(rows, columns, 0.9 + 0.45 * width * rows, width * columns)
    _frame(figure, axes)
    for column, (n, experiment, file, found) in enumerate(meshes):
        snapshots = campaigns[experiment].variables(file, ("position", "plastic_strain"))
        for axis, time in zip(axes[:, column], SHOWN, strict=True):
            k = snapshot_at(found["snapshot_time"], time)
            if k is None:
                axis.text(2.5, 1.0, "not reached", ha="center", fontsize=7)
                continue
            size = (1.5 * 72.0 * 0.9 * width / 5.0 * 2.0 / n) ** 2  # dots of 1.5 particle spacings
            particles(axis, snapshots["position"][k], snapshots["plastic_strain"][k], STRAIN, size)
            axis.text(4.9, 2.0, f"{time:g} s", ha="right", va="top", fontsize=7)
        axes[0, column].set_title(f"h = {4.0 / n:g} m")
    scale = ScalarMappable(Normalize(*STRAIN), "viridis")
    below: dict[str, Any] = {"location": "bottom", "shrink": 0.5, "aspect": 40, "extend": "max"}
    figure.colorbar(scale, ax=axes, label="equivalent plastic strain", **below)
    number = {"MPM": 11, "GMM-MLS": 12, "GMM-LME": 13}[name]
    caption = "Particles at their places."
    for n, experiment in MESHES:
        end = cell(campaigns, experiment, "final_run_out", **METHODS[name], resolution=n).text
        if end and n not in [mesh[0] for mesh in meshes]:
            caption += f" h = {4.0 / n:g} m is not here ({end}): the run was ended before it could store any."
    title = f"Fig. {number}: equivalent plastic strain, {name}"
    page.draw(f"strain-{name.lower()}", title, caption, figure)


def _frame(figure: Figure, axes: np.ndarray) -> None:
    """The same view of the column in all panels, labelled along the left and the lower edge."""
    for (row, column), axis in np.ndenumerate(axes):
        axis.set(xlim=(0.0, 5.0), ylim=(0.0, 2.2), yticks=(0, 1, 2), aspect="equal")
        axis.tick_params(labelsize=6, labelbottom=row == len(axes) - 1, labelleft=column == 0)
    for axis in axes[-1]:  # a name below the figure would stand below its scale of colours
        axis.set_xlabel("position $x_1$ [m]")
    figure.supylabel("position $x_2$ [m]", size=8)


def snapshot_at(times: np.ndarray, wanted: float) -> int | None:
    """Number of the snapshot at an instant [s]; None when the run ended before."""
    k = int(np.argmin(np.abs(times - wanted)))
    return k if abs(times[k] - wanted) < 0.02 else None


def _outlines(page: Chapter, campaigns: Campaigns) -> None:
    """Fig. 10: surfaces of the three methods at a few instants, one row per mesh."""
    runs = {(run[0], name): run[1:] for name in COLUMNS for run in _available(campaigns, name)}
    meshes = sorted({n for n, _ in runs})
    figure, axes = panels(len(meshes), len(SHOWN), 0.5 + 0.95 * len(meshes))
    for (n, name), (experiment, file, found) in runs.items():
        position = campaigns[experiment].variables(file, ("position",))["position"]
        for axis, time in zip(axes[meshes.index(n)], SHOWN, strict=True):
            k = snapshot_at(found["snapshot_time"], time)
            if k is not None:
                line = look(name) | {"marker": None, "lw": 1.0}
                axis.plot(*surface(position[k], 4.0 / n), **line)
    _frame(figure, axes)
    for axis, time in zip(axes[0], SHOWN, strict=True):
        axis.set_title(f"{time:g} s")
    for axis, n in zip(axes[:, 0], meshes, strict=True):
        axis.set_ylabel(f"h = {4.0 / n:g} m")
    axes[0, -1].legend(fontsize=5, loc="lower left")
    caption = "Highest particle over strips as wide as a cell."
    page.draw("outlines", "Fig. 10: surface of the column", caption, figure)


def surface(position: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Highest particle in each strip of the given width [m]: places and heights [m]."""
    strip = np.floor(position[:, 0] / width).astype(int)
    strips = np.unique(strip)
    return (strips + 0.5) * width, np.array([position[strip == s, 1].max() for s in strips])


def soil_check_chapter(campaigns: Campaigns) -> Chapter:
    """Kinetic energy against the authors' program, and what open choices change."""
    page = Chapter(
        "soil_check", "Soil column: check against the authors' program, and open choices"
    )
    page.statement = (
        "Kratos Multiphysics 10.4.4, h = 0.1 m, a(0) = g: kinetic energy 717.1 J at 0.05 s and "
        "239.2 J at 0.10 s."
    )
    figure, axes = single(height=2.8, width=1.6 * style.COLUMN)
    rows: list[list[Any]] = []
    for k, (name, match) in enumerate(SETUPS.items()):
        file, found = history(campaigns, "soil_check", "time", "kinetic_energy", **match)
        time, energy = found["time"], found["kinetic_energy"]
        line: dict[str, Any] = {"lw": 2.4 - 0.4 * k, "ls": ("-", "-", "-", "--", ":")[k]}
        axes.plot(*thinned(time, energy), color=f"C{k}", label=name, **line)
        energies = of_file(file, *np.interp([t for t, _ in REFERENCE], time, energy))
        run_out = cell(campaigns, "soil_check", "final_run_out", **match)
        rows.append([name, *(with_digits(4, one) for one in energies), run_out])
    axes.plot(*zip(*REFERENCE, strict=True), "k+", ms=9, label="Kratos 10.4.4, a(0) = g")
    axes.set(xlabel="time [s]", ylabel="kinetic energy [J]")
    figure.legend(fontsize=7, loc="outside right center")
    page.draw("energy", "Kinetic energy, implicit MPM", "h = 0.1 m, time step 2 ms.", figure)
    reference = [Cell(energy, digits=4) for _, energy in REFERENCE]
    rows.append(["Kratos 10.4.4, a(0) = g", *reference, ""])
    columns = ["set-up", "energy at 0.05 s [J]", "energy at 0.10 s [J]", "run-out at 0.5 s [m]"]
    page.tabulate("energies", "Kinetic energies", columns, rows, numeric=(1, 2, 3))
    return page


def animation_chapter(campaigns: Campaigns) -> Chapter:
    """The collapse as a moving picture."""
    page = Chapter("animation", "The collapse as a moving picture")
    _, found = history(campaigns, "animation", "snapshot_time", "position", "plastic_strain")
    gif = moving_picture(found["snapshot_time"], found["position"], found["plastic_strain"])
    caption = "Implicit MPM, h = 0.1 m, from 0 to 2 s in 4 s: particles coloured by equivalent plastic strain."
    page.animate("collapse", "Collapse of the soil column", caption, gif)
    return page


def moving_picture(times: np.ndarray, position: np.ndarray, strain: np.ndarray) -> bytes:
    """An animated GIF of particles, shapes (T,), (T, P, 2) and (T, P), with one palette."""
    figure, axes = single(height=2.0, width=1.3 * style.COLUMN)
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(150)
    dots = particles(axes, position[0], strain[0], STRAIN, 9.5)
    axes.set(
        xlim=(0.0, 5.0), ylim=(0.0, 2.2), xlabel="position $x_1$ [m]", ylabel="position $x_2$ [m]"
    )
    figure.colorbar(dots, ax=axes, label="equivalent plastic strain", extend="max")
    clock = axes.text(4.9, 2.0, "", ha="right", va="top", fontsize=7)
    pictures = []
    for k in range(len(times)):
        dots.set_offsets(position[k])
        dots.set_array(strain[k])
        clock.set_text(f"{times[k]:.2f} s")
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
        figure.set_layout_engine("none")
    palette = pictures[-1].quantize(COLOURS)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    file = io.BytesIO()
    pace = [100] * (len(frames) - 1) + [1500]  # [ms]; the end rests
    frames[0].save(
        file, "GIF", save_all=True, append_images=frames[1:], duration=pace, loop=0, optimize=True
    )
    return file.getvalue()
