"""Places of version 0.1 that plug-ins written for it still name: importing one gives what stands there now."""

import ast
import importlib
import sys
from collections.abc import Container, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

MOVED = {
    "mpmbench.core.algebra": "mpmbench.core.compiled.algebra",
    "mpmbench.core.bases.bspline": "mpmbench.core.bases.grid.bspline",
    "mpmbench.core.bases.cloud": "mpmbench.core.bases.clouds.cloud",
    "mpmbench.core.bases.hull": "mpmbench.core.geometry.hull",
    "mpmbench.core.bases.knots": "mpmbench.core.bases.grid.knots",
    "mpmbench.core.bases.kernel": "mpmbench.core.bases.clouds.sph_kernel",
    "mpmbench.core.bases.linear": "mpmbench.core.bases.grid.linear",
    "mpmbench.core.bases.lme": "mpmbench.core.bases.entropy.lme",
    "mpmbench.core.bases.maxent": "mpmbench.core.bases.entropy.maxent",
    "mpmbench.core.bases.mls": "mpmbench.core.bases.clouds.mls",
    "mpmbench.core.bases.quads": "mpmbench.core.bases.cells.quads",
    "mpmbench.core.bases.search": "mpmbench.core.bases.clouds.search",
    "mpmbench.core.bases.simplices": "mpmbench.core.bases.cells.simplices",
    "mpmbench.core.bases.tensor": "mpmbench.core.bases.grid.spline",
    "mpmbench.core.materials.elastic_fluid": "mpmbench.core.materials.elastic.elastic_fluid",
    "mpmbench.core.materials.hencky_elastic": "mpmbench.core.materials.elastic.hencky_elastic",
    "mpmbench.core.materials.mohr_coulomb": "mpmbench.core.materials.plastic.mohr_coulomb",
    "mpmbench.core.materials.neo_hookean": "mpmbench.core.materials.elastic.neo_hookean",
    "mpmbench.core.materials.small_strain_elastic": "mpmbench.core.materials.elastic.small_strain_elastic",
    "mpmbench.core.materials.st_venant_kirchhoff": "mpmbench.core.materials.elastic.st_venant_kirchhoff",
    "mpmbench.core.methods": "mpmbench.core.loops",
    "mpmbench.core.methods.explicit": "mpmbench.core.loops.explicit",
    "mpmbench.core.rows": "mpmbench.core.compiled.rows",
    "mpmbench.core.threads": "mpmbench.core.compiled.threads",
    "mpmbench.core.triangulate": "mpmbench.core.geometry.triangulate",
}


class MovedModules(MetaPathFinder, Loader):
    """Finds modules under their old names."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(name, self) if name in MOVED else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(MOVED[spec.name])
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """It has been executed under its own name, and keeps that."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


def keep_old_places() -> None:
    """Let old names be imported from now on."""
    if not any(isinstance(finder, MovedModules) for finder in sys.meta_path):
        sys.meta_path.insert(0, MovedModules())


def complete(old: type, base: type) -> None:
    """Give a class that was written before `base` was a base class what it does not define itself."""
    for name, default in vars(base).items():
        if not name.startswith("_") and not hasattr(old, name):
            setattr(old, name, default)


def advice(file: Path, public: Container[str]) -> str:
    """One sentence on imports of a plug-in's file that have a better place now; empty when there are none.

    The names in `public` are those that ``mpmbench`` itself offers. What cannot be read or parsed
    gets no advice, but an error on import.
    """
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return ""
    old = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mpmbench.")
    ]
    names = [(node.module, alias.name) for node in old for alias in node.names]
    lines = []
    found = sorted({name for _, name in names if name in public})
    if found:
        lines.append(f"from mpmbench import {', '.join(found)}")
    for module in sorted({module for module, _ in names if module in MOVED}):
        rest = [name for place, name in names if place == module and name not in public]
        if rest:
            lines.append(f"from {MOVED[module]} import {', '.join(rest)}")
    if not lines:
        return ""
    return f"{file.name}, line {old[0].lineno}: places have changed; write `{'; '.join(lines)}`"
