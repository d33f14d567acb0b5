"""What chapters and claims on the family share: its methods, and what they are asked for."""

from typing import Any

ERROR = "error_displacement_rms"
CELLS = (8, 16, 32)
SEEDINGS = ("polar", "cartesian")
METHODS: dict[str, dict[str, Any]] = {
    "MPM, hats": {"method": "mpm", "basis": "linear"},
    "uGIMP": {"method": "mpm", "basis": "gimp", "basis__domain": "uniform"},
    "cpGIMP": {"method": "mpm", "basis": "gimp", "basis__domain": "contiguous"},
    "CPDI": {"method": "mpm", "basis": "cpdi"},
    "MPM, splines": {"method": "mpm", "basis": "bspline"},
    "TLMPM, hats": {"method": "tlmpm", "basis": "linear"},
    "TLMPM, splines": {"method": "tlmpm", "basis": "bspline"},
}
TRANSFERS: dict[str, dict[str, Any]] = {
    "pic": {"method__transfer": "pic"},
    "flip": {"method__transfer": "flip"},
    "apic": {"method__transfer": "apic", "method__mass_cutoff": 1e-6},
    "apic, no cut-off": {"method__transfer": "apic", "method__mass_cutoff": 0.0},
    "tpic": {"method__transfer": "tpic"},
    "xpic(2)": {"method__transfer": "xpic", "method__transfer_order": 2},
    "xpic(5)": {"method__transfer": "xpic", "method__transfer_order": 5},
    "fmpm(2)": {"method__transfer": "fmpm", "method__transfer_order": 2},
    "fmpm(3)": {"method__transfer": "fmpm", "method__transfer_order": 3},
    "fmpm(5)": {"method__transfer": "fmpm", "method__transfer_order": 5},
}
CROSSING = {
    "hats": {"basis": "linear"},
    "gimp": {"basis": "gimp"},
    "cpdi": {"basis": "cpdi"},
    "splines": {"basis": "bspline"},
}
CROSSING_CELLS = (32, 64, 128, 256)
LOCKING = {
    "finite elements": {"method": "fem"},
    "implicit MPM, hats": {"method": "implicit_mpm", "basis": "linear"},
    "implicit MPM, splines": {"method": "implicit_mpm", "basis": "bspline"},
}
