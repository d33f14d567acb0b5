"""The field's own tests, one chapter each: tables of all methods, and figures where a curve says more."""

from mpmbench.papers.family.support import (
    CELLS,
    CROSSING,
    CROSSING_CELLS,
    ERROR,
    LOCKING,
    METHODS,
    SEEDINGS,
    TRANSFERS,
)
from mpmbench.papers.kit import Campaigns, Chapter, cell
from mpmbench.papers.parts import along, error_lines, quantities
from mpmbench.report.figures import panels, single


def vortex_chapter(campaigns: Campaigns) -> Chapter:
    """Displacement errors at the largest rotation, by seeding."""
    page = Chapter("vortex", "Generalised vortex: a ring in shear that turns by half a radian")
    page.statement = (
        "Kamojjala et al. 2015: MPM and GIMP break down, CPDI survives. De Vaucorbeil et al. 2020: "
        "TLMPM is of second order and the most accurate."
    )
    campaigns["vortex"]
    figure, axes = panels(1, 2, 3.2)
    for axis, seeding in zip(axes[0], SEEDINGS, strict=True):
        rows = {
            name: along(
                campaigns, "vortex", ERROR, "resolution", CELLS, **match, problem__seeding=seeding
            )
            for name, match in METHODS.items()
        }
        error_lines(axis, CELLS, rows, "displacement error [m]")
        axis.set_title(f"{seeding} seeds")
        head = ["method", *(f"{n} cells" for n in CELLS)]
        title = f"Displacement error at t = T/2 [m], {seeding} seeds"
        table = [[name, *found] for name, found in rows.items()]
        page.tabulate(seeding, title, head, table, numeric=(1, 2, 3))
    axes[0, 0].legend(fontsize=6)
    page.draw("errors", "Displacement error", "A run that broke down has no point.", figure)
    page.notes.append("Seeding decides as much as the method: compare within one table only.")
    return page


def heavy_bar_chapter(campaigns: Campaigns) -> Chapter:
    """Elongation and largest gap under both loads."""
    page = Chapter("heavy-bar", "Vertical bar: a block that its weight stretches")
    page.statement = (
        "Sadeghirad et al. 2011: CPDI shows no numerical fracture. Converged finite elements: "
        "0.3531 m at 300 m/s2, 1.6666 m at 1000 m/s2. A bar that has parted falls freely, and its "
        "elongation is none."
    )
    campaigns["heavy_bar"]
    wanted = ("elongation", "error_elongation", "largest_gap")
    head = ["method", "elongation [m]", "relative error", "largest gap"]
    for load in (300, 1000):
        for n in (8, 16):
            match = {"problem__gravity": load, "resolution": n}
            rows = [
                [name, *quantities(campaigns, "heavy_bar", wanted, **method, **match)]
                for name, method in {**METHODS, "OTM, max-ent": {"method": "otm"}}.items()
            ]
            title = f"At {load} m/s2, {n} cells"
            page.tabulate(f"{load}-{n}", title, head, rows, numeric=(1, 2, 3))
    return page


def crossing_chapter(campaigns: Campaigns) -> Chapter:
    """Stress errors of a bar whose particles cross cells."""
    page = Chapter("crossing", "A vibrating bar: what crossing cells does to stresses")
    page.statement = "Bardenhagen and Kober 2004: GIMP removes the noise of crossing."
    campaigns["crossing"]
    rows = {
        name: along(
            campaigns, "crossing", "error_stress_rms", "resolution", CROSSING_CELLS, **match
        )
        for name, match in CROSSING.items()
    }
    figure, axes = single()
    error_lines(axes, CROSSING_CELLS, rows, "stress error [Pa]")
    axes.legend(fontsize=7)
    page.draw("stress", "Stress error", "MPM with four functions, amplitude 0.5 m/s.", figure)
    head = ["functions", *(f"{n} cells" for n in CROSSING_CELLS), "crossings, 256 cells"]
    table = [
        [
            name,
            *found,
            cell(campaigns, "crossing", "n_cell_crossings", **CROSSING[name], resolution=256),
        ]
        for name, found in rows.items()
    ]
    page.tabulate("errors", "Stress error [Pa]", head, table, numeric=range(1, 6))
    return page


def transfers_chapter(campaigns: Campaigns) -> Chapter:
    """What each transfer leaves of a disk's rotation."""
    page = Chapter("transfers", "A disk with a slot that spins for half a turn")
    page.statement = (
        "Jiang et al. 2015: APIC conserves angular momentum. Hammerquist and Nairn 2017, Nairn and "
        "Hammerquist 2021: XPIC and FMPM dissipate less than PIC."
    )
    campaigns["transfers"]
    wanted = ("angular_momentum_kept", "kinetic_energy_kept", "shape_residual", "lag_of_angle")
    rows = [
        [name, *quantities(campaigns, "transfers", wanted, **match)]
        for name, match in TRANSFERS.items()
    ]
    head = [
        "transfer",
        "angular momentum kept",
        "kinetic energy kept",
        "shape residual [m]",
        "lag [rad]",
    ]
    title = "After half a turn, quadratic splines, 8 cells per radius"
    page.tabulate("kept", title, head, rows, numeric=range(1, 5))
    return page


def locking_chapter(campaigns: Campaigns) -> Chapter:
    """Cook's membrane with and without F-bar."""
    page = Chapter("locking", "Cook's membrane at nu = 0.4999: volumetric locking")
    page.statement = (
        "Converged: the middle of the right edge rises by 6.90 mm, its corner by 6.85 mm. Coombs et "
        "al. 2018: F-bar removes locking."
    )
    campaigns["locking"]
    rows = [
        [
            name,
            volumetric,
            *along(
                campaigns,
                "locking",
                "middle_over_reference",
                "resolution",
                CELLS,
                **match,
                method__volumetric=volumetric,
            ),
        ]
        for name, match in LOCKING.items()
        for volumetric in ("standard", "f_bar")
    ]
    head = ["method", "volumetric", *(f"{n} cells" for n in CELLS)]
    page.tabulate("rise", "Rise of the middle over 6.90 mm", head, rows, numeric=(2, 3, 4))
    return page
