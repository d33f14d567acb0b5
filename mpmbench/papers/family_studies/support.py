"""Names of the methods in the three studies, and what tells their runs apart."""

from typing import Any

Match = dict[str, Any]
WALL: Match = {"problem__behind": "wall"}
HATS: Match = {"method": "mpm", "basis": "linear", "problem__behind": "room"}
SPLINES: Match = {"method": "ulmpm", "basis": "bspline", "basis__reconstruction": "none", **WALL}
PLAIN: Match = {
    "method__transfer": "flip",
    "method__stress_update": "usl",
    "method__gradient": "functions",
}
CANTILEVER: dict[str, Match] = {
    "MPM, hats": {**HATS, **PLAIN},
    "MPM, hats, MUSL": {**HATS, **PLAIN, "method__stress_update": "musl"},
    "MPM, hats, USAVG": {**HATS, **PLAIN, "method__stress_update": "usavg"},
    "MPM, hats, pic": {**HATS, "method__transfer": "pic"},
    "MPM, hats, apic": {**HATS, "method__transfer": "apic"},
    "MPM, hats, xpic(5)": {**HATS, "method__transfer": "xpic"},
    "MPM, hats, fmpm(3)": {**HATS, "method__transfer": "fmpm"},
    "ULMPM, splines": {**SPLINES, **PLAIN},
    "ULMPM, splines, apic": {**SPLINES, **PLAIN, "method__transfer": "apic"},
    "ULMPM, splines, tpic": {**SPLINES, **PLAIN, "method__transfer": "tpic"},
    "ULMPM, splines, apic, affine gradients": {
        **SPLINES,
        "method__transfer": "apic",
        "method__gradient": "affine",
    },
    "ULMPM, splines, xpic(5)": {**SPLINES, **PLAIN, "method__transfer": "xpic"},
    "uGIMP": {"method": "mpm", "basis": "gimp", "basis__domain": "uniform"},
    "GIMP, stretches of U": {"method": "mpm", "basis": "gimp", "basis__domain": "finite"},
    "CPDI": {"method": "mpm", "basis": "cpdi"},
    "CPDI2": {"method": "mpm", "basis": "cpdi2"},
    "DDMP": {"method": "mpm", "basis": "ddmp"},
    "ULMPM, splines, TLS": {**SPLINES, **PLAIN, "basis__reconstruction": "tls"},
    "TLMPM, hats (tlmpm)": {"method": "tlmpm", "basis": "linear"},
    "TLMPM, splines (tlmpm)": {"method": "tlmpm", "basis": "bspline", "method__transfer": "flip"},
    "TLMPM, splines, apic (tlmpm)": {
        "method": "tlmpm",
        "basis": "bspline",
        "method__transfer": "apic",
    },
    "moving mesh (moving_mesh_mpm)": {"method": "moving_mesh_mpm"},
    "OTM, max-ent": {"method": "otm"},
    "linear finite elements": {"method": "linear_fem"},
}
WALLED = {
    name
    for name, match in CANTILEVER.items()
    if match.get("problem__behind") == "wall"
    or match.get("basis") in ("gimp", "cpdi", "cpdi2", "ddmp")
}

LME: Match = {"method": "otm", "basis": "lme"}
MLS: Match = {"method": "otm", "basis": "mls", "problem__particle_layout": "nodes"}
NODES: Match = {"problem__particle_layout": "nodes"}
BETWEEN: Match = {"problem__particle_layout": "midpoint"}
UPDATED: Match = {"method__shape_functions": "updated"}
KEPT: Match = {"method__shape_functions": "frozen"}
WAVES: dict[str, Match] = {
    "finite elements": {"method": "linear_fem"},
    "LME, Eulerian": LME | BETWEEN | UPDATED,
    "LME, Lagrangian": LME | BETWEEN | KEPT,
    "LME, Eulerian, nodal": LME | NODES | UPDATED,
    "LME, Lagrangian, nodal": LME | NODES | KEPT,
    "MLS, Eulerian, nodal": MLS | UPDATED,
    "MLS, Lagrangian, nodal": MLS | KEPT | {"method__gradient": "functions"},
    "MLS, Lagrangian, SCNI": MLS | KEPT | {"method__gradient": "conforming"},
    "MPM, hats": {"method": "mpm", "basis": "linear"},
    "uGIMP": {"method": "mpm", "basis": "gimp"},
    "MPM, splines": {"method": "mpm", "basis": "bspline"},
    "TLMPM, splines": {"method": "tlmpm"},
}
STRETCHES = (0.8, 1.0, 1.2, 1.5, 2.0)

TRACTION: dict[str, Match] = {
    "hats": {"basis": "linear"},
    "DDMP": {"basis": "ddmp"},
    "uGIMP": {"basis": "gimp"},
    "splines": {"basis": "bspline"},
}
CELLS = (64, 128, 256)
INNER = "error_stress_inner"
