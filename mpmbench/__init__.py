"""mpmbench: particle methods of solid mechanics on the same problem, particles and norm.

All that a user or a plug-in needs has its place here, and is imported when it is first used: the
command line must start without numba and xarray.
"""

from __future__ import annotations

import importlib  # and nothing that `python -m mpmbench` would look for in the current folder

TYPE_CHECKING = False  # as in `typing`
if TYPE_CHECKING:
    from typing import Any

    from mpmbench.api import run as run
    from mpmbench.api import sweep as sweep
    from mpmbench.results.campaign import open_campaign as open_campaign
    from mpmbench.scripting import make as make
    from mpmbench.scripting import simulate as simulate
    from mpmbench.settings.schema import BadInput as BadInput

__version__ = "0.2.0"

NAMES = {  # by the module in which they stand
    "api": "run sweep",
    "scripting": "make simulate",
    "results.campaign": "open_campaign",
    "settings.schema": "BadInput",
    # Geometry, particles and loads
    "core.geometry": "Box Cloud Geometry tensor_points",
    "core.particles": "ParticleData Particles seed_cells",
    "core.state": "Loads State",
    "core.simulation": "Body Solution",
    # What a plug-in registers, and how a run ends without a result
    "core.registry": "register",
    "core.setting": "Settings setting",
    "problems": "Problem Fields",
    "core.choices": "Choices",
    "core.loops": "LoopPromises TimeLoop",
    "core.loops.explicit": "Explicit",
    "core.transfer": "Transfer TransferPromises",
    "core.materials": "Material cauchy_stress kirchhoff_stress energy_density",
    "core.materials.isotropic": "IsotropicElastic Lame",
    "core.bases": "Basis BasisSettings Promises StoredBasis",
    "core.bases.handle": "Stencils count index interpolate locate locate_batch place room scratch spread value",
    "core.bases.grid.product": "GridBasis product product_fields",
    "core.errors": "BadSetting BrokeDown Diverged NotApplicable NotConverged require",
    # Compiled code
    "core.compiled": "compiled implements inlined kernel lean matrix vector",
    "core.compiled.algebra": "determinant",
}
PLACES = {name: module for module, names in NAMES.items() for name in names.split()}
__all__ = ["__version__", *PLACES]


def __getattr__(name: str) -> Any:
    """Import a name when it is first asked for."""
    if name not in PLACES:
        raise AttributeError(f"module 'mpmbench' has no attribute '{name}'")
    return getattr(importlib.import_module(f"mpmbench.{PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *PLACES})
