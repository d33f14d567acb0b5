"""What the members of the family cost beside their plain relatives, and what transfers lose."""

from mpmbench.contracts.audit import audit
from mpmbench.core.loops.explicit import Explicit, step

from .goals import measured
from .measure import interleaved, plate

TIME_STEP = 1e-6  # [s]
TRANSFERS = (
    *(("flip", 1), ("pic", 1), ("apic", 1), ("tpic", 1)),
    *(("xpic", 2), ("xpic", 5), ("fmpm", 2), ("fmpm", 5)),
)

BASES: tuple[tuple[str, str, dict[str, object]], ...] = (
    ("splines", "bspline", {}),
    ("tls", "bspline", {"basis.reconstruction": "tls"}),
    ("tls, 2", "bspline", {"basis.reconstruction": "tls", "basis.reconstruction_degree": 2}),
    ("ddmp", "ddmp", {}),
    ("gimp", "gimp", {}),
    ("cpdi", "cpdi", {}),
    ("cpdi2", "cpdi2", {}),
)
STEPS = {"tls": "TLS over splines, step"}


def family() -> None:
    """Steps of each transfer over those of flip, and of the relatives of splines over those of splines."""
    print("\nTransfers: whole steps on the plate, quadratic B-splines, 129 x 129 nodes, over flip")
    tasks = {}
    for name, order in TRANSFERS:
        keys = {"method.transfer": name, "method.transfer_order": order}
        state = plate("bspline", 128, **keys)
        tasks[f"{name} {order}"] = lambda state=state: step(state, TIME_STEP)
    seconds = interleaved(tasks)  # type: ignore[arg-type]
    particles = len(state.particles.x)
    for row, value in seconds.items():
        print(f"{row:12} {value / particles * 1e9:8.1f} ns {value / seconds['flip 1']:7.2f}")
    measured("apic over flip, step, quadratic", seconds["apic 1"] / seconds["flip 1"])
    print("\nBases: whole steps on the plate, 129 x 129 nodes, over quadratic B-splines")
    tasks = {}
    for row, basis, keys in BASES:
        state = plate(basis, 128, **keys)
        tasks[row] = lambda state=state: step(state, TIME_STEP)
    seconds = interleaved(tasks)  # type: ignore[arg-type]
    for row, value in seconds.items():
        ratio = value / seconds["splines"]
        print(f"{row:12} {value / particles * 1e9:8.1f} ns {ratio:7.2f}")
        if row in STEPS:
            measured(STEPS[row], ratio)


def transfers() -> None:
    """The audit: what each transfer loses and lets in (`mpmbench.contracts.audit`)."""
    print(
        "\nTransfers: change of angular momentum, losses of energy per step, noise left, order in time"
    )
    print(
        f"{'transfer':10} {'spin':>9} {'rotation':>9} {'wave':>9} {'shear':>9} {'noise':>9} {'order':>6}"
    )
    cases = [*TRANSFERS, ("xpic", 1), ("xpic", 3), ("fmpm", 3), ("blend", 1)]
    for name, order in sorted(cases):
        found = audit(Explicit(transfer=name, transfer_order=order, flip=0.95, mass_cutoff=0.0))
        figures = [found.spin, found.rotation, found.wave, found.shear, found.noise]
        row = f"{name} {order}" if name in ("xpic", "fmpm") else name
        print(f"{row:10} " + " ".join(f"{one:9.1e}" for one in figures) + f" {found.order:6.1f}")
